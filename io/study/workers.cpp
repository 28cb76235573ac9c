// SPDX-License-Identifier: Apache-2.0
#include "io/study/workers.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <iostream>
#include <map>
#include <set>

extern char** environ;

namespace h6::study {
namespace {

constexpr int kTries = 3;  // of a run, each in a new process

struct Worker {
  pid_t pid = -1;
  int to = -1, from = -1;
  std::string heard;
  std::set<std::size_t> runs;  // under way
};

// Pipes are not inherited but by dup2, so each worker hears of the end of this process.
bool start(const std::string& program, const std::vector<std::string>& command, Worker& worker) {
  int to[2], from[2];
  if (pipe2(to, O_CLOEXEC) != 0) return false;
  if (pipe2(from, O_CLOEXEC) != 0) return close(to[0]), close(to[1]), false;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, to[0], 0);
  posix_spawn_file_actions_adddup2(&actions, from[1], 1);
  std::vector<std::string> words = command;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int failed =
      posix_spawnp(&worker.pid, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(to[0]), close(from[1]);
  if (failed) return close(to[1]), close(from[0]), errno = failed, false;
  worker.to = to[1], worker.from = from[0];
  worker.heard.clear(), worker.runs.clear();
  return true;
}

void end(Worker& worker) {
  if (worker.pid < 0) return;
  close(worker.to), close(worker.from);
  while (waitpid(worker.pid, nullptr, 0) < 0 && errno == EINTR) {
  }
  worker.pid = -1;
}

class Pool {
 public:
  explicit Pool(const Work& work)
      : work_(work), queue_(work.runs.begin(), work.runs.end()), workers_(work.processes) {}
  ~Pool() {
    for (Worker& worker : workers_) end(worker);
  }

  Outcome run() {
    while (left_to_do() && work_.go_on()) {
      for (Worker& worker : workers_)
        if (const Outcome given = give(worker); !given) return given;
      if (const Outcome heard = listen(); !heard) return heard;
    }
    return Done{};
  }

 private:
  bool left_to_do() const {
    for (const Worker& worker : workers_)
      if (!worker.runs.empty()) return true;
    return !queue_.empty();
  }
  Outcome give(Worker& worker) {
    if (worker.runs.size() >= work_.ahead || queue_.empty()) return Done{};
    if (worker.pid < 0 && !start(work_.program, work_.command, worker))
      return Failure{"cannot start " + work_.program + ": " + std::strerror(errno)};
    std::string lines;
    while (worker.runs.size() < work_.ahead && !queue_.empty()) {
      lines += std::to_string(queue_.front()) + "\n";
      worker.runs.insert(queue_.front());
      queue_.pop_front();
    }
    // A worker that died meanwhile is found by the end of its answers.
    (void)!write(worker.to, lines.data(), lines.size());
    return Done{};
  }
  Outcome listen() {
    std::vector<pollfd> ends;
    for (const Worker& worker : workers_)
      ends.push_back({worker.pid < 0 ? -1 : worker.from, POLLIN, 0});
    if (poll(ends.data(), ends.size(), 200) <= 0) return Done{};
    for (std::size_t i = 0; i < ends.size(); ++i)
      if (ends[i].revents)
        if (const Outcome heard = hear(workers_[i]); !heard) return heard;
    return Done{};
  }
  Outcome hear(Worker& worker) {
    char text[4096];
    const ssize_t n = read(worker.from, text, sizeof text);
    if (n < 0 && errno == EINTR) return Done{};
    if (n <= 0) return died(worker);
    worker.heard.append(text, static_cast<std::size_t>(n));
    for (std::size_t end; (end = worker.heard.find('\n')) != std::string::npos;) {
      const std::string line = worker.heard.substr(0, end);
      worker.heard.erase(0, end + 1);
      if (const Outcome taken = take(worker, line); !taken) return taken;
    }
    return Done{};
  }
  Outcome take(Worker& worker, const std::string& line) {
    if (line[0] == '!') return Failure{line.substr(1)};
    const bool lost = line[0] == '?';
    const char* const digits = line.c_str() + lost;
    char* rest = nullptr;
    const std::size_t run = std::strtoull(digits, &rest, 10);
    if (rest == digits || worker.runs.erase(run) == 0)
      return Failure{"a worker answers what nobody asked: " + line.substr(0, 100)};
    if (lost) return work_.done(work_.lost(run, *rest ? rest + 1 : rest), NAN);
    const std::size_t tab = line.rfind('\t');
    if (tab == std::string::npos)
      return Failure{"a worker does not say how long it took: " + line.substr(0, 100)};
    return work_.done(line.substr(0, tab), std::strtod(line.c_str() + tab, nullptr));
  }
  // Its runs go to another, unless they have brought several down.
  Outcome died(Worker& worker) {
    const std::set<std::size_t> runs = std::move(worker.runs);
    end(worker);
    worker.runs.clear();
    if (!work_.go_on()) return Done{};
    for (const std::size_t run : runs) {
      if (++tries_[run] < kTries) {
        queue_.push_front(run);
      } else if (const Outcome done = work_.done(
                     work_.lost(run, "the process of this run ended three times before its end"),
                     NAN);
                 !done) {
        return done;
      }
    }
    return Done{};
  }

  const Work& work_;
  std::deque<std::size_t> queue_;
  std::vector<Worker> workers_;
  std::map<std::size_t, int> tries_;
};

}  // namespace

Outcome share_out(const Work& work) {
  struct sigaction ignore {
  }, before{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, &before);
  Outcome outcome = Pool(work).run();
  sigaction(SIGPIPE, &before, nullptr);
  return outcome;
}

void serve(const std::function<std::string(std::size_t run)>& answer) {
  for (std::string line; std::getline(std::cin, line);) {
    const auto start = std::chrono::steady_clock::now();
    std::string text = answer(std::stoul(line));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    if (text[0] != '!' && text[0] != '?') text += "\t" + std::to_string(took.count());
    text += "\n";
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
      return;
  }
}

}  // namespace h6::study
