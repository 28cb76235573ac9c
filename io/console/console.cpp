// SPDX-License-Identifier: Apache-2.0
#include "io/console/console.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "hapsix/hapsix.h"
#include "io/file/write_aside.h"

namespace h6::cli {

std::atomic<bool> interrupted{false};

namespace {

constexpr unsigned kHookTime = 5;  // most that a hook may take; then the process is killed [s]
std::atomic<void (*)(void*)> signal_hook{nullptr};
std::atomic<void*> signal_context{nullptr};

// The first signal asks the work to end; a second one cleans up and exits at once.
void on_signal(int number) {
  if (auto hook = signal_hook.load()) {
    alarm(kHookTime);  // it stops devices, in the code of plug-ins too
    hook(signal_context.load());
    alarm(0);
  }
  if (interrupted.exchange(true)) {
    io::remove_unfinished();
    _exit(128 + number);
  }
}

// On a crash signal this stops the devices and then lets the former handler act.
constexpr int kCrashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT};
struct sigaction before_crash[std::size(kCrashes)];
void on_crash(int number) {
  for (std::size_t i = 0; i < std::size(kCrashes); ++i)
    if (kCrashes[i] == number) sigaction(number, &before_crash[i], nullptr);
  h6HaltAll();
  raise(number);
}

}  // namespace

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // not under nohup
  action.sa_handler = on_crash;
  for (std::size_t i = 0; i < std::size(kCrashes); ++i)
    sigaction(kCrashes[i], &action, &before_crash[i]);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // a write over the file size limit then fails with a sentence
}

void set_signal_hook(void (*hook)(void*), void* context) {
  signal_hook.store(nullptr);
  signal_context.store(context);
  signal_hook.store(hook);
}

namespace {

// Signal handlers call this. Text that cannot be written is lost.
void write_all(int to, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t some = write(to, text.data() + done, text.size() - done);
    if (some <= 0) return;
    done += static_cast<std::size_t>(some);
  }
}

}  // namespace

EndsAtOnce::EndsAtOnce(const Console& console, const std::string& sentence) {
  static std::string error,
      result;  // the handler must not allocate, nor find these strings destroyed
  error =
      (isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "") + ("hapsix: " + printable(sentence)) + "\n";
  result = console.json ? Console::text({{"error", sentence}}, 2) + "\n" : "";
  set_signal_hook(
      [](void*) {
        io::remove_unfinished();
        write_all(STDERR_FILENO, error);
        write_all(STDOUT_FILENO, result);
        _exit(kFailed);
      },
      nullptr);
}

EndsAtOnce::~EndsAtOnce() { set_signal_hook(nullptr, nullptr); }

namespace {

// The bytes of the UTF-8 character at `at`, and its code; 0 where there is none.
std::size_t character(const std::string& text, std::size_t at, std::uint32_t& code) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(at);
  const std::size_t bytes = lead < 0x80                   ? 1
                            : lead >= 0xF0 && lead < 0xF5 ? 4
                            : lead >= 0xE0 && lead < 0xF0 ? 3
                            : lead >= 0xC2 && lead < 0xE0 ? 2
                                                          : 0;
  if (bytes == 0 || at + bytes > text.size()) return 0;
  code = bytes == 1 ? lead : lead & (0x7Fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(at + i) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(at + i) & 0x3Fu);
  }
  return bytes;
}

bool harmless(std::uint32_t code) {
  if (code == '\n' || code == '\t') return true;
  const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
  const bool turns = code == 0x200E || code == 0x200F || code == 0x61C ||
                     (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return !control && !turns && code != 0x2028 && code != 0x2029;
}

}  // namespace

std::string printable(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    std::uint32_t code = 0;
    const std::size_t bytes = character(text, at, code);
    if (bytes > 0 && harmless(code)) {
      out.append(text, at, bytes);
      at += bytes;
      continue;
    }
    for (const std::size_t end = at + std::max<std::size_t>(bytes, 1); at < end; ++at) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned char>(text[at]));
      out += escaped;
    }
  }
  return out;
}

void Console::log(const std::string& text) const {
  std::fprintf(stderr, "%s\n", printable(text).c_str());
}

void Console::warn(const std::vector<std::string>& sentences) const {
  for (const std::string& s : sentences) log("warning: " + s);
}

int Console::fail(std::string sentence, int code) const {
  // Sentences come from many sources; this gives them all the same ending.
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

namespace {

using Clock = std::chrono::steady_clock;

// Returns "about 3 s left", from the speed so far; empty while too little work is done to estimate.
std::string time_left(double seconds, double share) {
  if (seconds < 1 || share < 0.02 || share >= 1) return "";
  const double left = seconds * (1 - share) / share;
  const double minutes = left / 60, hours = minutes / 60;
  char text[32];
  if (left < 99.5)
    std::snprintf(text, sizeof text, " about %.0f s left", std::max(left, 1.0));
  else if (minutes < 99.5)
    std::snprintf(text, sizeof text, " about %.0f min left", minutes);
  else
    std::snprintf(text, sizeof text, " about %.0f h left", std::min(hours, 999.0));
  return text;
}

struct Bar {
  Clock::time_point start = Clock::now(), shown = start, began = start;
  double share = 0;
  bool drawn = false;
  ~Bar() { clear(); }
  void clear() {
    if (drawn) std::fprintf(stderr, "\r\033[K");
    drawn = false;
  }
  // The line has at most 80 columns, because a longer one would wrap and could not be erased.
  void draw(const std::string& what, Clock::time_point now) {
    constexpr int width = 20;
    const int full = static_cast<int>(width * share);
    const double worked = std::chrono::duration<double>(now - began).count();
    std::fprintf(stderr, "\r\033[K%-28.28s [%s%s] %3.0f %%%s", printable(what).c_str(),
                 std::string(full, '#').c_str(), std::string(width - full, ' ').c_str(),
                 100 * share, time_left(worked, share).c_str());
    std::fflush(stderr);
    drawn = true;
    shown = now;
  }
};

}  // namespace

io::Progress Console::progress() const {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  return [terminal, bar = std::make_shared<Bar>()](const std::string& what, double done) {
    const auto now = Clock::now();
    const double share = done > 0 ? std::min(done, 1.0) : 0;  // NaN is 0
    if (share < bar->share) bar->began = now;                 // the next piece of work has begun
    bar->share = share;
    if (terminal && now - bar->start > std::chrono::milliseconds(500) &&
        now - bar->shown > std::chrono::milliseconds(80))
      bar->draw(what, now);
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
