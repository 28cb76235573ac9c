// SPDX-License-Identifier: Apache-2.0
// json.cpp - one pass over the text that builds no tree, so that a hostile file costs neither stack
// nor memory.
#include "io/file/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

namespace h6::io {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kDeepest = 32;
constexpr std::size_t kMostValues = 1'000'000;

// Text of a file for an error sentence: short, and without control characters for a terminal.
std::string printable(const std::string& text, std::size_t most) {
  std::string out;
  for (const char c : text) {
    if (out.size() == most) return out + "...";
    out += c >= ' ' && c <= '~' ? c : '?';
  }
  return out;
}

class Gate final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (keys_.back().insert(name).second) return true;
    complaint = "the key \"" + printable(name, 60) + "\" stands twice in one object; remove one";
    return false;
  }
  bool parse_error(std::size_t at, const std::string&,
                   const nlohmann::detail::exception& e) override {
    position = at;
    // Drop the package's own "[json.exception...] parse error at line 1, column 2: ".
    std::string what = e.what();
    for (const char* prefix : {"] ", "parse error at line"}) {
      const std::size_t found = what.find(prefix);
      if (found == std::string::npos) continue;
      const std::size_t end = prefix[0] == ']' ? found + 2 : what.find(": ", found) + 2;
      what.erase(0, std::min(end, what.size()));
    }
    complaint = "not valid JSON: " + printable(what, 300);
    return false;
  }

  std::string complaint;
  std::size_t position = 0;  // bytes read up to a parse error; 0 without one

 private:
  bool value() {
    if (++values_ <= kMostValues) return true;
    complaint = "more than a million values: this is not a scene";
    return false;
  }
  bool open() {
    keys_.emplace_back();
    if (keys_.size() > kDeepest) complaint = "nested deeper than 32: this is not a scene";
    return keys_.size() <= kDeepest && value();
  }
  bool close() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> keys_;  // of each open object; empty for an open array
  std::size_t values_ = 0;
};

}  // namespace

Outcome check_json_text(const std::string& text, const std::string& name) {
  Gate gate;
  if (Json::sax_parse(text, &gate)) return Done{};
  if (gate.position == 0) return Failure{name + ": " + gate.complaint};
  const std::size_t end = std::min(gate.position, text.size());
  // `end` is one past the byte that is wrong.
  const std::size_t at = end == 0 ? 0 : end - 1;
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
  const std::size_t line_start = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const std::size_t column = line_start == std::string::npos ? at + 1 : at - line_start;
  return Failure{name + ": line " + std::to_string(line) + ", column " + std::to_string(column) +
                 ": " + gate.complaint};
}

}  // namespace h6::io
