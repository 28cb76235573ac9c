// SPDX-License-Identifier: Apache-2.0
// target.cpp - runs all benchmarks on the SIMD target that HAPSIX_SIMD names.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>

#include "kernels/targets.h"

namespace {

const bool chosen = [] {
  if (const char* const why = h6::kernels::force_target_from_environment()) {
    std::fprintf(stderr, "%s\n", why);
    std::exit(2);
  }
  benchmark::AddCustomContext("simd_target", h6::kernels::target_name());
  return true;
}();

}  // namespace
