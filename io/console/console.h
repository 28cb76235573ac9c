// SPDX-License-Identifier: Apache-2.0
// console.h - what the program says and where: results on stdout, everything else on stderr.
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
  // The sentence on stderr; with json also {"error": sentence} on stdout. Returns `code`.
  int fail(std::string sentence, int code = kFailed) const;
  // As text: names come from files, so what is not UTF-8 is replaced, not thrown at the user.
  static std::string text(const nlohmann::ordered_json& object, int indent = -1);
  // The result of a command, when json is set.
  void result(const nlohmann::ordered_json& object) const;
  // After all work: `code`, or kFailed where stdout took not everything (a full disk).
  int finish(int code) const;
  // A bar on the terminal for work over half a second, with an estimate of the time that is left;
  // returns false once the user interrupts.
  io::Progress progress() const;
};

// While it lives, SIGINT and SIGTERM end the program where it stands, within milliseconds: files in
// the making are removed, `sentence` is told as by Console::fail, exit kFailed. For work that asks
// nobody whether to go on - reading a mesh of any size, writing a field to a slow disk - and whose
// only traces are files written aside. One at a time.
class EndsAtOnce {
 public:
  EndsAtOnce(const Console& console, const std::string& sentence);
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

// Set by SIGINT and SIGTERM: work ends soon and leaves nothing half made.
extern std::atomic<bool> interrupted;
// Handlers are the program's, never a library's. `on_stop` runs inside the handler.
void install_signal_handlers();
void set_signal_hook(void (*hook)(void*), void* context);

std::string number(double value, int digits);

}  // namespace h6::cli
