// SPDX-License-Identifier: Apache-2.0
#include "io/file/text_scan.h"

#include <charconv>
#include <cstring>
#include <system_error>

namespace h6::io {
namespace {

const char* find_byte(const char* from, const char* end, char byte) {
  const void* found = from == end ? nullptr : std::memchr(from, byte, end - from);
  return found ? static_cast<const char*>(found) : end;
}

// The length in bytes of the UTF-8 character at the start of `text`; 0 for a control character and
// for bytes that are not UTF-8.
std::size_t printable_sequence(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7f;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const bool overlong = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xf0 && byte(1) < 0x90);
  const bool no_character = (first == 0xed && byte(1) > 0x9f) || (first == 0xf4 && byte(1) > 0x8f);
  const bool control = first == 0xc2 && byte(1) < 0xa0;
  return overlong || no_character || control ? 0 : length;
}

std::string cleaned(std::string_view text, std::size_t longest) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = printable_sequence(text);
    if (out.size() + (length ? length : 1) > longest) return out + "...";
    if (length)
      out.append(text.substr(0, length));
    else
      out += '?';
    text.remove_prefix(length ? length : 1);
  }
  return out;
}

}  // namespace

TextScan::TextScan(std::string_view text, bool continued)
    : at_(text.data()),
      line_end_(text.data()),
      end_(text.data() + text.size()),
      // Very old files end their lines with a carriage return alone.
      newline_(text.find('\n') == text.npos ? '\r' : '\n'),
      continued_(continued) {
  // Some editors write a byte order mark.
  if (text.starts_with("\xef\xbb\xbf")) line_end_ = at_ += 3;
}

bool TextScan::next_line() {
  const char* next = started_ && line_end_ != end_ ? line_end_ + 1 : started_ ? end_ : at_;
  if (next == end_) {
    at_ = line_end_ = end_;  // so that word() finds nothing more of the last line
    return false;
  }
  at_ = next;
  line_ += 1 + joined_;
  joined_ = 0;
  started_ = true;
  line_end_ = find_byte(at_, end_, newline_);
  while (continued_ && line_end_ != end_) {
    const char* last = line_end_;
    if (last > at_ && last[-1] == '\r') --last;
    if (last == at_ || last[-1] != '\\') break;
    ++joined_;
    line_end_ = find_byte(line_end_ + 1, end_, newline_);
  }
  return true;
}

std::string_view TextScan::word() {
  while (at_ != line_end_ && blank(*at_)) ++at_;
  const char* begin = at_;
  while (at_ != line_end_ && !blank(*at_)) ++at_;
  return {begin, static_cast<std::size_t>(at_ - begin)};
}

std::string_view TextScan::next_word() {
  for (;;) {
    if (started_) {
      const std::string_view found = word();
      if (!found.empty()) return found;
    }
    if (!next_line()) return {};
  }
}

std::string_view TextScan::rest() const {
  const char *begin = at_, *end = line_end_;
  while (begin != end && blank(*begin)) ++begin;
  while (end != begin && blank(end[-1])) --end;
  return {begin, static_cast<std::size_t>(end - begin)};
}

std::string_view TextScan::behind() const {
  const char* begin = !started_ ? at_ : line_end_ == end_ ? end_ : line_end_ + 1;
  return {begin, static_cast<std::size_t>(end_ - begin)};
}

const char* parse_number(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  if (word.size() > 200) return " is too long for a number";
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::invalid_argument || end != word.data() + word.size())
    return word.empty() ? " is not a number (the line ends early)" : " is not a number";
  if (error == std::errc::result_out_of_range) {
    // With at most 200 characters only an exponent leaves the range; its sign tells which end.
    const std::size_t exponent = word.find_first_of("eE");
    if (exponent == word.npos || word.substr(exponent + 1, 1) != "-")
      return " is too large for a number";
    value = 0;
  }
  return nullptr;
}

const char* parse_number(std::string_view word, std::int64_t& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::invalid_argument || end != word.data() + word.size())
    return word.empty() ? " is not a whole number (the line ends early)" : " is not a whole number";
  return error == std::errc::result_out_of_range ? " is too large for a number" : nullptr;
}

std::string quoted(std::string_view word) {
  std::string text(1, '\'');
  text += cleaned(word, 32);
  return text += '\'';
}

std::string printable(std::string_view name) { return cleaned(name, 200); }

bool same_word(std::string_view word, std::string_view lower_case) {
  if (word.size() != lower_case.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char c = word[i] >= 'A' && word[i] <= 'Z' ? static_cast<char>(word[i] + 32) : word[i];
    if (c != lower_case[i]) return false;
  }
  return true;
}

}  // namespace h6::io
