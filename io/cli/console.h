// console.h - what the program says and where: results on stdout, everything else on stderr.
#pragma once
#include <atomic>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/progress.h"

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
  // A bar on the terminal for work over half a second; returns false once the user interrupts.
  io::Progress progress() const;
};

// Set by SIGINT and SIGTERM: work ends soon and leaves nothing half made.
extern std::atomic<bool> interrupted;
// Handlers are the program's, never a library's. `on_stop` runs inside the handler.
void install_signal_handlers();
void set_signal_hook(void (*hook)(void*), void* context);

std::string number(double value, int digits);

}  // namespace h6::cli
