// SPDX-License-Identifier: Apache-2.0
// forced_target.h - runs a test program on the SIMD target that HAPSIX_SIMD names.
#pragma once
#include <cstdio>

#include "kernels/targets.h"

namespace h6::test {

// 0, or the exit code of a test program that cannot run: 77 (skipped, for ctest) where the machine
// lacks the target, 2 where the name is wrong.
inline int force_target_or_exit_code() {
  bool built = false;
  const char* const why = kernels::force_target_from_environment(&built);
  if (why == nullptr) return 0;
  std::fprintf(stderr, "%s\n", why);
  return built ? 77 : 2;
}

}  // namespace h6::test
