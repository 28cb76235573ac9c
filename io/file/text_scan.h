// SPDX-License-Identifier: Apache-2.0
// text_scan.h - lines, words and numbers of a text mesh. It reads the bytes in place, does not
// depend on the locale, and counts lines.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace h6::io {

class TextScan {
 public:
  // `continued`: a backslash at a line's end joins it to the next one (OBJ).
  explicit TextScan(std::string_view text, bool continued = false);

  bool next_line();               // false at the end
  std::string_view word();        // of this line; empty at its end
  std::string_view next_word();   // of this line or a later one; empty at the end of the text
  std::string_view rest() const;  // of this line, without blanks at either end
  std::size_t line() const { return line_; }  // from 1
  std::string_view behind() const;            // everything after this line

 private:
  bool blank(char c) const {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' ||
           (continued_ && (c == '\\' || c == '\n'));
  }
  const char* at_;
  const char* line_end_;
  const char* end_;
  char newline_;
  bool continued_;
  bool started_ = false;
  std::size_t line_ = 0, joined_ = 0;
};

// Null when the word is a number, else the fault that completes the sentence "line 3: " +
// quoted(word) + fault.
const char* parse_number(std::string_view word, double& value);
const char* parse_number(std::string_view word, std::int64_t& value);

// 'word' for a terminal: cut when long, with '?' for every byte that is not printable text.
std::string quoted(std::string_view word);

// A part's name: at most 200 bytes of valid UTF-8 without control characters.
std::string printable(std::string_view name);

bool same_word(std::string_view word, std::string_view lower_case);  // ignores the word's case

}  // namespace h6::io
