// SPDX-License-Identifier: Apache-2.0
// checks.h - checks of arguments before any work begins: a mistake is reported within milliseconds,
// not after a long bake.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::cli {
// Parses the whole text as a finite number; returns false if it is none.
inline bool parse(const std::string& text, double& value) {
  char* end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0' && std::isfinite(value);
}

inline std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

inline std::string must_be(const std::string& what, const std::string& text) {
  return "must be " + what + ", not '" + text + "'";
}

// The number of letters to insert, remove or exchange (Levenshtein), computed one row at a time.
inline std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t exchanged = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, exchanged});
    }
  }
  return row[b.size()];
}

// Checks for options. Each returns an empty string, or what is wrong with the text.
using Check = std::function<std::string(const std::string&)>;

inline Check number_above(double low) {
  return [low](const std::string& text) {
    double value;
    return parse(text, value) && value > low ? std::string{}
                                             : must_be("a number above " + number_text(low), text);
  };
}

inline Check number_within(double low, double high) {
  return [low, high](const std::string& text) {
    double value;
    if (parse(text, value) && low <= value && value <= high) return std::string{};
    return must_be("a number from " + number_text(low) + " to " + number_text(high), text);
  };
}

inline Check whole_within(long long low, long long high) {
  return [low, high](const std::string& text) {
    double value;
    const bool digits = text.find_first_not_of("-0123456789") == std::string::npos;
    if (digits && parse(text, value) && static_cast<double>(low) <= value &&
        value <= static_cast<double>(high))
      return std::string{};
    return must_be("a whole number from " + std::to_string(low) + " to " + std::to_string(high),
                   text);
  };
}

inline Check one_of(std::vector<std::string> names) {
  return [names = std::move(names)](const std::string& text) {
    if (std::find(names.begin(), names.end(), text) != names.end()) return std::string{};
    std::string list;
    for (std::size_t i = 0; i < names.size(); ++i)
      list += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
    return must_be(list, text);
  };
}

// The name most like `text`, or empty when none is near.
inline std::string nearest(const std::string& text, const std::vector<std::string>& names) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, text.size() / 3) + 1;
  if (text.size() > 100) return best;
  for (const std::string& name : names)
    if (const std::size_t d = edit_distance(text, name); d < least) least = d, best = name;
  return best;
}

// "there is no method 'x', did you mean 'y'?", or else the list of all.
inline std::string no_such(const std::string& what, const std::string& name,
                           const std::vector<std::string>& known) {
  const std::string like = nearest(name, known);
  std::string list;
  for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
  return "there is no " + what + " '" + name + "'" +
         (like.empty() ? "; there are " + list : ", did you mean '" + like + "'?");
}

// The file must exist and be regular: a pipe would keep the reader waiting for ever.
inline Outcome check_input(const std::string& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) return Failure{file + ": there is no such file"};
  if (std::filesystem::is_directory(status))
    return Failure{file + ": this is a folder, name a file in it"};
  if (!std::filesystem::is_regular_file(status))
    return Failure{file + ": this is not a regular file"};
  return Done{};
}

// The file must be a recording, or a killed run must have left its log beside that name.
inline Outcome check_recording(const std::string& file) {
  std::error_code error;
  return std::filesystem::is_regular_file(file + ".part", error) ? Done{} : check_input(file);
}

// A file must be writable there. Commands check this before a bake of minutes, not after it.
inline Outcome check_output(const std::string& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    return Failure{"cannot write " + file + ": it is a folder, name a file in it"};
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder, error))
    return Failure{"cannot write " + file + ": the folder " + folder.string() +
                   " does not exist, create it first"};
  return Done{};
}

// Checks the ending of a file name, because other programs recognise a file by it.
inline Check ends_with(std::string ending) {
  return [ending = std::move(ending)](const std::string& text) {
    const bool good = text.size() > ending.size() &&
                      text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
    return good ? std::string{} : must_be("a file name that ends in " + ending, text);
  };
}

}  // namespace h6::cli
