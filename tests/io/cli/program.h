// SPDX-License-Identifier: Apache-2.0
// program.h - runs the program as a user would, with a folder and a cache of its own, and returns
// its exit code and output. It links nothing of hapsix.
#pragma once
#include <doctest/doctest.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/sanitized.h"

namespace h6::test {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Args = std::vector<std::string>;

inline std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}
inline void spill(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

// The result of a process. `code` is its exit code, or minus the signal that ended it.
struct Ended {
  int code = 0;
  bool in_time = true;  // false if it hung and was killed
  std::string out, err;
  double cpu_seconds = 0;  // user and system time; it hardly depends on the load of the machine
  double wall_seconds = 0;
};

// The working folder of the processes that a test starts; the destructor removes it. Their cache
// and their output lie beside it, so that `files` shows only files that the program made.
class Sandbox {
 public:
  Sandbox() {
    char name[] = "/tmp/hapsix-cli-XXXXXX";
    REQUIRE(mkdtemp(name) != nullptr);
    root_ = name;
    fs::create_directories(folder());
    fs::create_directories(cache());
  }
  ~Sandbox() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  fs::path folder() const { return root_ / "work"; }
  fs::path cache() const { return root_ / "cache"; }
  fs::path file(const std::string& name) const { return folder() / name; }
  std::set<std::string> files() const {
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder()))
      found.insert(fs::relative(entry.path(), folder()).string());
    return found;
  }
  // A new file for an output stream of a process.
  fs::path stream() { return root_ / ("stream-" + std::to_string(streams_++)); }

 private:
  fs::path root_;
  int streams_ = 0;
};

// A running program. `terminal` >= 0 (an end of a pty) becomes its stdin and stderr; the constructor
// closes it here. `most_bytes` > 0 limits the size of its files, as on a full disk.
class Process {
 public:
  Process(Sandbox& box, const Args& args, const std::string& cache = "", int terminal = -1,
          rlim_t most_bytes = 0)
      : out_(box.stream()), err_(box.stream()), start_(Clock::now()) {
    std::vector<char*> argv;
    static std::string program = HAPSIX_PROGRAM;
    argv.push_back(program.data());
    args_ = args;
    for (std::string& a : args_) argv.push_back(a.data());
    argv.push_back(nullptr);
    const std::string folder = box.folder(), keep = cache.empty() ? box.cache().string() : cache;
    pid_ = fork();
    REQUIRE(pid_ >= 0);
    if (pid_ != 0) {
      if (terminal >= 0) close(terminal);  // else the reader would never see the end of the stream
      return;
    }
    setenv("HAPSIX_CACHE", keep.c_str(), 1);
    signal(SIGINT, SIG_DFL);  // a shell without job control starts its jobs with SIGINT ignored
    redirect(open(out_.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    if (terminal >= 0) dup2(terminal, STDIN_FILENO);
    redirect(terminal >= 0 ? terminal : open(err_.c_str(), O_WRONLY | O_CREAT, 0600),
             STDERR_FILENO);
    const rlimit limit{most_bytes, most_bytes};
    if (most_bytes > 0) setrlimit(RLIMIT_FSIZE, &limit);
    if (chdir(folder.c_str()) == 0) execv(argv[0], argv.data());
    _exit(127);
  }
  ~Process() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int number) const { kill(pid_, number); }
  // Whether the program has installed its handler for the signal.
  bool handles(int number) const {
    std::error_code gone;  // before exec it is a copy of this process, with the same handlers
    if (!fs::equivalent("/proc/" + std::to_string(pid_) + "/exe", HAPSIX_PROGRAM, gone))
      return false;
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigCgt:"))
        return std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1;
    return false;
  }
  // Whether the program has ended. wait() still returns the result.
  bool ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  // User and system time so far [s]. What a program does after a signal costs such time; how long it
  // waits for a core is the machine's affair.
  double cpu_seconds() const {
    const std::string stat = slurp("/proc/" + std::to_string(pid_) + "/stat");
    std::istringstream fields(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, system = 0;
    fields >> user >> system;
    return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }
  // Waits for the end and kills the program after `limit` seconds, which is ample on a busy
  // machine. ThreadSanitizer gets ten times as long, AddressSanitizer three times.
  Ended wait(double limit = 100) {
    if (kSanitized) limit *= kThreadSanitized ? 10 : 3;
    Ended ended;
    const auto begun = Clock::now();
    int status = 0;
    rusage used{};
    while (wait4(pid_, &status, WNOHANG, &used) == 0) {
      if (seconds_since(begun) > limit && ended.in_time) {
        ended.in_time = false;
        kill(pid_, SIGKILL);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    pid_ = -1;
    ended.wall_seconds = seconds_since(start_);
    ended.cpu_seconds = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
    ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    ended.out = slurp(out_), ended.err = slurp(err_);
    return ended;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_since(Clock::time_point t) {
    return std::chrono::duration<double>(Clock::now() - t).count();
  }
  static double seconds_of(const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  static void redirect(int from, int to) {
    dup2(from, to);
    close(from);
  }

  fs::path out_, err_;
  Args args_;
  Clock::time_point start_;
  pid_t pid_ = -1;
};

inline Ended run(Sandbox& box, const Args& args, const std::string& cache = "") {
  return Process(box, args, cache).wait();
}

// Reads stdout, which must be one JSON object and nothing else. Otherwise a check fails and the
// result is null.
inline Json one_object(const Ended& ended) {
  const Json json = Json::parse(ended.out, nullptr, false);
  INFO("stdout: ", ended.out.substr(0, 500), "\nstderr: ", ended.err.substr(0, 500));
  CHECK(json.is_object());
  return json.is_object() ? json : Json::object();
}

// Runs the program with --json. It must succeed.
inline Json result_of(Sandbox& box, Args args, const std::string& cache = "") {
  args.push_back("--json");
  const Ended ended = run(box, args, cache);
  INFO("stderr: ", ended.err);
  CHECK(ended.code == 0);
  return one_object(ended);
}

// Waits until the condition holds. Returns false after `limit` seconds.
template <class Condition>
bool soon(Condition condition, double limit = 100) {
  for (double waited = 0; waited < limit; waited += 0.005) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return condition();
}

// Whether the log of a running recording has kSomeFrames: it begins with up to 60 kB about the run,
// and a frame takes some 200 bytes.
constexpr int kSomeFrames = 40;
inline bool records(const Sandbox& box, const std::string& name) {
  std::error_code absent;
  const auto bytes = fs::file_size(box.file(name + ".part"), absent);
  return !absent && bytes > 120'000;
}

// --- meshes, written by hand so that no test relies on the library's own writer -----------------

using Corner = std::array<float, 3>;
using Facet = std::array<Corner, 3>;

inline std::string stl(const std::vector<Facet>& facets, const char* name = "") {
  std::string text(80, '\0');
  std::memcpy(text.data(), name, std::min<std::size_t>(80, std::strlen(name)));
  const auto append = [&](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<std::uint32_t>(facets.size()));
  for (const Facet& facet : facets) {
    append(Corner{});
    append(facet);
    append(std::uint16_t{0});
  }
  return text;
}

inline std::vector<Facet> box_facets(float edge) {
  static const int quads[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                  {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  const auto corner = [edge](int i) {
    return Corner{edge * static_cast<float>(i >> 2), edge * static_cast<float>(i >> 1 & 1),
                  edge * static_cast<float>(i & 1)};
  };
  std::vector<Facet> facets;
  for (const auto& q : quads) {
    facets.push_back({corner(q[0]), corner(q[1]), corner(q[2])});
    facets.push_back({corner(q[0]), corner(q[2]), corner(q[3])});
  }
  return facets;
}

inline std::vector<Facet> sphere_facets(float radius, int rings) {
  const double pi = std::acos(-1.0);
  const int sides = 2 * rings;
  const auto at = [&](int i, int j) {
    if (i == 0 || i == rings) return Corner{0, 0, i == 0 ? radius : -radius};
    const double polar = pi * i / rings, around = 2 * pi * (j % sides) / sides;
    return Corner{static_cast<float>(radius * std::sin(polar) * std::cos(around)),
                  static_cast<float>(radius * std::sin(polar) * std::sin(around)),
                  static_cast<float>(radius * std::cos(polar))};
  };
  std::vector<Facet> facets;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sides; ++j) {
      if (i > 0) facets.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i < rings - 1) facets.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return facets;
}

}  // namespace h6::test
