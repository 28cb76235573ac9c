// SPDX-License-Identifier: Apache-2.0
// targets.h - everything that reads bytes from outside, each as a function of any bytes.
//
// `./dev fuzz` lets libFuzzer search them; corpus_test.cpp gives them the seeds and all findings of
// the past. A target ends the process (broken) when a promise does not hold.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace h6::fuzz {

struct Target {
  const char* name;
  void (*take)(std::string_view bytes);
};

std::span<const Target> targets();
const Target* find_target(std::string_view name);  // null: there is none

// Says which promise does not hold and aborts.
[[noreturn]] void broken(const char* promise);
inline void promise(bool holds, const char* what) {
  if (!holds) broken(what);
}

// Writes the bytes to a file of that name in a folder of this process in memory. Returns its name.
std::string as_file(std::string_view bytes, const char* name);

// Every refusal is one sentence that a terminal can show.
inline void check_sentence(const std::string& sentence) {
  promise(!sentence.empty() && sentence.size() < 5000, "an error is one sentence");
}

void take_contract(std::string_view bytes);  // contract.cpp
void take_http(std::string_view bytes);      // http.cpp
void take_run_text(std::string_view bytes);  // run_text.cpp
void take_study(std::string_view bytes);     // study.cpp

}  // namespace h6::fuzz
