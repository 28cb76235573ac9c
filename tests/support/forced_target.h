// SPDX-License-Identifier: Apache-2.0
// forced_target.h - runs a test program on the SIMD target that HAPSIX_SIMD names.
#pragma once
#include <cstdio>

#include "kernels/targets.h"

namespace h6::test {

// Returns 0 when the test program can run, else its exit code: 77 (ctest counts it as skipped) when
// the machine lacks the target, 2 when the name is wrong.
inline int force_target_or_exit_code() {
  bool built = false;
  const char* const why = kernels::force_target_from_environment(&built);
  if (why == nullptr) return 0;
  std::fprintf(stderr, "%s\n", why);
  return built ? 77 : 2;
}

}  // namespace h6::test
