// SPDX-License-Identifier: Apache-2.0
// target.cpp - all benchmarks on a lesser instruction set: HAPSIX_BENCH_TARGET=AVX2 hapsix_bench.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>

#include "kernels/targets.h"

namespace {

const bool chosen = [] {
  const char* name = std::getenv("HAPSIX_BENCH_TARGET");
  if (name != nullptr && *name != '\0' && !h6::kernels::force_target(name)) {
    std::fprintf(stderr, "HAPSIX_BENCH_TARGET: this machine or build has no %s\n", name);
    std::exit(2);
  }
  benchmark::AddCustomContext("simd_target", h6::kernels::target_name());
  return true;
}();

}  // namespace
