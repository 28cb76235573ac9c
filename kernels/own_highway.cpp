// SPDX-License-Identifier: Apache-2.0
// own_highway.cpp - the engine's own run-time part of Highway.
//
// A program may bring another version of Highway, or force a target of its own. Then the linker
// would give both of them one table of the chosen target. So CMakeLists.txt compiles all kernels
// with the namespace hwy renamed to h6_hwy, and what Highway's library would define is defined
// here. Only the question what the machine can do goes to that library.
#include <hwy/targets.h>

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "hapsix/base.h"

#undef hwy
namespace hwy {
std::int64_t SupportedTargets();
}

namespace h6_hwy {
namespace {
std::int64_t forced_targets = 0;
}

std::int64_t SupportedTargets() {
  return forced_targets ? forced_targets : hwy::SupportedTargets();
}
void SetSupportedTargetsForTest(std::int64_t targets) { forced_targets = targets; }

ChosenTarget& GetChosenTarget() {
  static ChosenTarget chosen;
  return chosen;
}

// Highway's own assertions, which only debug builds have.
void Abort(const char* file, int line, const char* format, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  h6AssertFailed(text, file, line);
  std::abort();
}

}  // namespace h6_hwy
