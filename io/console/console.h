// SPDX-License-Identifier: Apache-2.0
// console.h - the program's output: results on stdout, everything else on stderr.
#pragma once
#include <atomic>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/file/progress.h"

namespace h6::cli {

// Exit codes of the whole program.
inline constexpr int kOk = 0, kFailed = 1, kUsage = 2;

class Console {
 public:
  bool json = false;  // one JSON object on stdout, nothing else

  // A line on stderr.
  void log(const std::string& text) const;
  void warn(const std::vector<std::string>& sentences) const;
  // Writes the sentence to stderr and, with json, {"error": sentence} to stdout. Returns `code`.
  int fail(std::string sentence, int code = kFailed) const;
  // JSON as text. Names come from files: bytes that are not UTF-8 are replaced.
  static std::string text(const nlohmann::ordered_json& object, int indent = -1);
  // Prints the result of a command if json is set.
  void result(const nlohmann::ordered_json& object) const;
  // Call this after all work. Returns `code`, or kFailed if stdout could not take everything (a
  // full disk).
  int finish(int code) const;
  // Shows a bar on the terminal for work over half a second, with an estimate of the remaining
  // time. The returned function returns false once the user interrupts.
  io::Progress progress() const;
};

// While it lives, SIGINT and SIGTERM end the program within milliseconds: unfinished files are
// removed, `sentence` is reported as by Console::fail, and the exit code is kFailed. Use it for
// work that never checks `interrupted` (reading a large mesh, writing to a slow disk) and that
// writes nothing but temporary files. Only one may exist at a time.
class EndsAtOnce {
 public:
  EndsAtOnce(const Console& console, const std::string& sentence);
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

// Set by SIGINT and SIGTERM: work then ends soon and leaves no unfinished file.
extern std::atomic<bool> interrupted;
// Only the program installs handlers, never a library. `hook` runs inside the handler.
void install_signal_handlers();
void set_signal_hook(void (*hook)(void*), void* context);

// `text` with its control characters escaped, "\x1b", because names come from files, and a terminal
// obeys such characters. Line feeds and tabs stay; so do letters of every script. Bytes that are
// not UTF-8 and characters that turn the direction of writing are escaped too.
std::string printable(const std::string& text);

std::string number(double value, int digits);

}  // namespace h6::cli
