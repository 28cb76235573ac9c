// SPDX-License-Identifier: Apache-2.0
// csv.h - texts as cells of a CSV file.
#pragma once
#include <string>

namespace h6::io {

inline std::string csv_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

}  // namespace h6::io
