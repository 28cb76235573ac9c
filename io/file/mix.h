// SPDX-License-Identifier: Apache-2.0
// mix.h - pseudo-random numbers without state.
#pragma once
#include <cstdint>

namespace h6::io {

// The i-th 64-bit number of a seed, for seeds, orders and jitter (the mixer of splitmix64).
inline std::uint64_t mix(std::uint64_t seed, std::uint64_t i) {
  std::uint64_t h = seed * 0x9E3779B97F4A7C15u + i + 0x632BE59BD9B4E019u;
  h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9u;
  h = (h ^ (h >> 27)) * 0x94D049BB133111EBu;
  return h ^ (h >> 31);
}

}  // namespace h6::io
