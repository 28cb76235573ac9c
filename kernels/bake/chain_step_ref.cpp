// SPDX-License-Identifier: Apache-2.0
// chain_step_ref.cpp - the specification of chain_step, chain_seeds, chain_sides,
// chain_nearest.
#include <algorithm>
#include <cmath>

#include "kernels/bake/chain_step.h"

namespace h6::kernels {

bool chain_step_ref(const Chain* from, std::size_t line, std::size_t layer, Chain* to,
                    std::size_t to_line, std::size_t to_layer) {
  const auto at = [&](int x, int y, int z) {
    return from[z * std::ptrdiff_t(layer) + y * std::ptrdiff_t(line) + x];
  };
  Chain now[512];
  bool changed = false;
  for (int n = 0; n < 512; ++n) {
    const int x = n % 8, y = n / 8 % 8, z = n / 64;
    int least = kChainFar;
    for (int i = 0; i < 27; ++i) {
      const int d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      const int apart = (d[0] != 0) + (d[1] != 0) + (d[2] != 0);
      least = std::min(least, at(x + d[0], y + d[1], z + d[2]) + kChainStep[apart]);
    }
    now[n] = static_cast<Chain>(least);
    changed |= now[n] != at(x, y, z);
  }
  for (std::size_t n = 0; n < 512; ++n)
    to[n / 64 * to_layer + n / 8 % 8 * to_line + n % 8] = now[n];
  return changed;
}

void chain_seeds_ref(const float* u, const std::uint64_t* mask, const ChainSeeds& seeds, Chain* to,
                     std::size_t to_line, std::size_t to_layer) {
  for (std::size_t z = 0; z < std::size_t(seeds.layers); ++z)
    for (std::size_t n = 0; n < 8 * std::size_t(seeds.lines); ++n) {
      const bool in = mask[z] >> n & 1;
      const float length = in ? seeds.level - u[64 * z + n] : seeds.level + u[64 * z + n];
      to[z * to_layer + n / 8 * to_line + n % 8] =
          in || seeds.through ? static_cast<Chain>(std::ceil(length * (1 / kChainUnit)))
                              : kChainFar;
    }
}

void chain_sides_ref(const Chain* chain, const float* u, const ChainLimits& limits,
                     ChainSides& out) {
  out = {};
  for (std::size_t n = 0; n < 512; ++n) {
    if (chain[n] >= kChainFar) continue;
    const float length = float(chain[n]) * kChainUnit;
    const std::uint64_t bit = std::uint64_t{1} << (n % 64);
    if (length < u[n] + limits.offset) {
      out.in_sight[n / 64] |= bit;
      const float dent = (length - limits.slack) / limits.crooked;
      if (dent > std::max(limits.offset - u[n], 0.0f)) out.dented[n / 64] |= bit;
    } else if (u[n] <= limits.close) {
      out.close[n / 64] |= bit;
    }
  }
}

void chain_nearest_ref(const Chain* from, std::size_t line, std::size_t layer,
                       const std::uint64_t* mask, std::uint8_t* nearest) {
  for (std::size_t n = 0; n < 512; ++n) {
    if ((mask[n / 64] >> (n / 8 % 8 * 8) & 0xff) == 0) continue;
    const Chain* at = from + n / 64 * layer + n / 8 % 8 * line + n % 8;
    int least = kChainFar;
    nearest[n] = 13;
    for (int i = 0; i < 27; ++i) {
      const int d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      const int apart = (d[0] != 0) + (d[1] != 0) + (d[2] != 0);
      const int way =
          at[d[2] * std::ptrdiff_t(layer) + d[1] * std::ptrdiff_t(line) + d[0]] + kChainStep[apart];
      if (apart == 0 || way >= least) continue;
      least = way;
      nearest[n] = static_cast<std::uint8_t>(i);
    }
  }
}

}  // namespace h6::kernels
