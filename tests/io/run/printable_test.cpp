// SPDX-License-Identifier: Apache-2.0
// Text from files reaches a terminal without anything that the terminal obeys.
#include <doctest/doctest.h>

#include <cstdint>
#include <string>

#include "io/console/console.h"

using h6::cli::printable;

namespace {

std::string utf8(std::uint32_t code) {
  const auto tail = [&](unsigned shift) {
    return static_cast<char>(0x80 | (code >> shift & 0x3F));
  };
  if (code < 0x80) return {static_cast<char>(code)};
  if (code < 0x800) return {static_cast<char>(0xC0 | code >> 6), tail(0)};
  if (code < 0x10000) return {static_cast<char>(0xE0 | code >> 12), tail(6), tail(0)};
  return {static_cast<char>(0xF0 | code >> 18), tail(12), tail(6), tail(0)};
}

std::string escaped(const std::string& bytes) {
  static const char* digits = "0123456789abcdef";
  std::string out;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    out += std::string("\\x") + digits[byte >> 4] + digits[byte & 15];
  }
  return out;
}

bool is_obeyed(std::uint32_t code) {
  const bool controls = code < 0x20 || (code >= 0x7F && code < 0xA0);
  const bool turns = code == 0x61C || code == 0x200E || code == 0x200F ||
                     (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  const bool breaks = code == 0x2028 || code == 0x2029;
  return (controls && code != '\n' && code != '\t') || turns || breaks;
}

}  // namespace

TEST_CASE("each character alone is shown as it is, or escaped if a terminal obeys it") {
  for (std::uint32_t code = 0; code < 0x20000; ++code) {
    if (code >= 0xD800 && code < 0xE000) continue;  // no characters
    const std::string bytes = utf8(code), shown = printable("a" + bytes + "b");
    const std::string expected = "a" + (is_obeyed(code) ? escaped(bytes) : bytes) + "b";
    if (shown != expected) FAIL_CHECK("U+", code, " is shown as '", shown, "'");
  }
}

TEST_CASE("bytes that are no UTF-8 are escaped, and what follows them is not swallowed") {
  for (unsigned byte = 0x80; byte < 0x100; ++byte) {
    const std::string bad(1, static_cast<char>(byte));
    CHECK(printable(bad) == escaped(bad));
    CHECK(printable(bad + "a") == escaped(bad) + "a");
    CHECK(printable(bad + "\x1b[2J") == escaped(bad) + "\\x1b[2J");
  }
  // Longer than need be, a surrogate, and beyond the last character.
  for (const char* bad : {"\xC0\x9B", "\xE0\x80\x9B", "\xF4\x90\x80\x80"})
    CHECK(printable(bad).find('\x9B') == std::string::npos);
  CHECK(printable("\xE2\x80") == "\\xe2\\x80");
}
