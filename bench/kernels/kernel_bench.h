// SPDX-License-Identifier: Apache-2.0
// kernel_bench.h - registers a kernel's benchmark for its reference and for every SIMD target.
//
// The last part of a name tells what ran: ".../ref", ".../SCALAR", ".../AVX3". ref is the
// specification, compiled with the same flags and vectorisation off; it may be another algorithm.
// SCALAR is the kernel itself with one lane. A run whose result is wrong reports no time.
#pragma once
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>

#include "kernels/targets.h"

namespace h6::kernels::bench {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  void direction(double v[3]) {
    const double z = uniform(-1, 1), angle = uniform(-M_PI, M_PI), r = std::sqrt(1 - z * z);
    v[0] = r * std::cos(angle), v[1] = r * std::sin(angle), v[2] = z;
  }

 private:
  std::mt19937_64 engine_;
};

// One benchmark: runs the kernel or the reference on its data, and checks the result of the last
// run.
struct Case {
  std::function<void()> kernel, reference;
  std::function<bool()> correct;
};

inline void run(benchmark::State& state, const std::function<Case()>& make, const char* target,
                std::size_t items) {
  const Case c = make();
  if (target != nullptr && !force_target(target))
    return state.SkipWithError("target not available");
  const auto& body = target != nullptr ? c.kernel : c.reference;
  body();
  if (!c.correct()) {
    state.SkipWithError("wrong result");
  } else {
    for (auto _ : state) {
      body();
      benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(items));
  }
  force_target(nullptr);
}

// `make` builds the data when the benchmark runs, not when it is registered. Without `reference`:
// SIMD targets only.
inline void add(const std::string& name, std::size_t items, const std::function<Case()>& make,
                bool reference = true) {
  const auto one = [&](const std::string& what, const char* target) {
    benchmark::RegisterBenchmark((name + "/" + what).c_str(), [=](benchmark::State& state) {
      run(state, make, target, items);
    })->Unit(benchmark::kMicrosecond);
  };
  if (reference) one("ref", nullptr);
  const char* names[32];
  const std::size_t count = supported_targets(names, 32);
  for (std::size_t k = 0; k < count; ++k) one(names[k], names[k]);
}

}  // namespace h6::kernels::bench
