// SPDX-License-Identifier: Apache-2.0
// kernel_test.h - shared by the kernel tests: seeded numbers, every SIMD target, columns with NaN
// around them.
#pragma once
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "kernels/targets.h"
#include "tests/support/sanitized.h"

namespace h6::kernels::test {

// The standard specifies the output of the engine but not of distributions, so these are ours.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  std::size_t below(std::size_t n) { return engine_() % n; }
  // A unit vector, uniform on the sphere.
  void direction(double v[3]) {
    double length2;
    do {
      length2 = 0;
      for (int k = 0; k < 3; ++k) {
        v[k] = uniform(-1, 1);
        length2 += v[k] * v[k];
      }
    } while (length2 > 1 || length2 < 1e-4);
    for (int k = 0; k < 3; ++k) v[k] /= std::sqrt(length2);
  }

 private:
  std::mt19937_64 engine_;
};

// The targets of the machine, or the one that HAPSIX_SIMD names.
inline std::vector<std::string> all_targets() {
  if (const char* forced = std::getenv("HAPSIX_SIMD"); forced && *forced) return {forced};
  const char* names[32];
  const std::size_t count = supported_targets(names, 32);
  // All targets share the same accesses, so the best and the least are enough here.
  if (h6::test::kThreadSanitized && count > 2) return {names[0], names[count - 1]};
  return {names, names + count};
}

// Runs body(target) with the kernels forced to each target of this machine, one after the other.
template <class Body>
void on_every_target(const Body& body) {
  for (const std::string& target : all_targets()) {
    CAPTURE(target);
    REQUIRE(force_target(target.c_str()));
    REQUIRE(target_name() == target);
    body(target);
  }
  force_target(nullptr);
}

// A column whose first row stands `shift` floats past an aligned address, with NaN on both sides.
class Column {
 public:
  Column(std::size_t count, std::size_t shift)
      : data_(count + 96, std::numeric_limits<float>::quiet_NaN()), shift_(shift), count_(count) {}
  // The first row depends on the address of the data, which a copy does not keep.
  Column(const Column&) = delete;
  Column(Column&&) = default;
  float* begin() {
    const auto address = reinterpret_cast<std::uintptr_t>(data_.data());
    return data_.data() + (64 - address % 64) % 64 / sizeof(float) + shift_;
  }
  float& operator[](std::size_t i) { return begin()[i]; }
  // Whether only rows 0..count-1 were written.
  bool padding_untouched() {
    for (const float& v : data_) {
      const bool inside = &v >= begin() && &v < begin() + count_;
      if (!inside && !std::isnan(v)) return false;
    }
    return true;
  }

 private:
  std::vector<float> data_;
  std::size_t shift_, count_;
};

inline bool same_bits(const float* a, const float* b, std::size_t count) {
  return count == 0 || std::memcmp(a, b, count * sizeof(float)) == 0;
}

}  // namespace h6::kernels::test
