#include "io/cli/console.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/write_aside.h"

namespace h6::cli {

std::atomic<bool> interrupted{false};

namespace {

std::atomic<void (*)(void*)> signal_hook{nullptr};
std::atomic<void*> signal_context{nullptr};

// The first signal asks; a second one ends the program at once, tidily.
void on_signal(int number) {
  if (auto hook = signal_hook.load()) hook(signal_context.load());
  if (interrupted.exchange(true)) {
    io::remove_unfinished();
    _exit(128 + number);
  }
}

}  // namespace

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

void set_signal_hook(void (*hook)(void*), void* context) {
  signal_hook.store(nullptr);
  signal_context.store(context);
  signal_hook.store(hook);
}

void Console::log(const std::string& text) const { std::fprintf(stderr, "%s\n", text.c_str()); }

void Console::warn(const std::vector<std::string>& sentences) const {
  for (const std::string& s : sentences) log("warning: " + s);
}

int Console::fail(std::string sentence, int code) const {
  // Sentences come from many places: here they all end alike.
  if (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
  log("hapsix: " + sentence);
  if (json) result({{"error", sentence}});
  return code;
}

std::string Console::text(const nlohmann::ordered_json& object, int indent) {
  return object.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

void Console::result(const nlohmann::ordered_json& object) const {
  if (json) std::printf("%s\n", text(object, 2).c_str());
}

int Console::finish(int code) const {
  errno = 0;
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  const int why = errno;
  if (why != EPIPE) log(std::string("hapsix: the result cannot be written: ") + std::strerror(why));
  return code == kOk ? kFailed : code;
}

io::Progress Console::progress() const {
  using Clock = std::chrono::steady_clock;
  struct Bar {
    Clock::time_point start = Clock::now(), shown = start;
    bool drawn = false;
    ~Bar() { clear(); }
    void clear() {
      if (drawn) std::fprintf(stderr, "\r\033[K");
      drawn = false;
    }
  };
  const bool terminal = isatty(STDERR_FILENO) != 0;
  return [terminal, bar = std::make_shared<Bar>()](const std::string& what, double done) {
    const auto now = Clock::now();
    if (terminal && now - bar->start > std::chrono::milliseconds(500) &&
        now - bar->shown > std::chrono::milliseconds(80)) {
      constexpr int width = 30;
      const double share = done > 0 ? std::min(done, 1.0) : 0;  // NaN is 0
      const int full = static_cast<int>(width * share);
      std::fprintf(stderr, "\r\033[K%-28.28s [%s%s] %3.0f %%", what.c_str(),
                   std::string(full, '#').c_str(), std::string(width - full, ' ').c_str(),
                   100 * share);
      std::fflush(stderr);
      bar->drawn = true;
      bar->shown = now;
    }
    if (done >= 1) bar->clear();
    return !interrupted.load();
  };
}

std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace h6::cli
