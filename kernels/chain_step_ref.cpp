// chain_step_ref.cpp - the specification of chain_step, chain_seeds, chain_sides.
#include <algorithm>
#include <cmath>

#include "kernels/chain_step.h"

namespace h6::kernels {

void chain_step_ref(const ChainBrick& brick, int steps, Chain* out) {
  ChainBrick now = brick;
  for (int step = 0; step < steps; ++step) {
    const ChainBrick last = now;
    for (int n = 0; n < 512; ++n) {
      int least = kChainFar;
      for (int i = 0; i < 27; ++i) {
        const int d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        const int apart = (d[0] != 0) + (d[1] != 0) + (d[2] != 0);
        least = std::min(least, last.v[n / 64 + 1 + d[2]][n / 8 % 8 + 1 + d[1]][n % 8 + 1 + d[0]] +
                                    kChainStep[apart]);
      }
      now.v[n / 64 + 1][n / 8 % 8 + 1][n % 8 + 1] = static_cast<Chain>(least);
    }
  }
  for (int n = 0; n < 512; ++n) out[n] = now.v[n / 64 + 1][n / 8 % 8 + 1][n % 8 + 1];
}

void chain_seeds_ref(const float* u, std::size_t u_apart, const std::uint8_t* mask,
                     std::size_t lines, float level, Chain* out, std::size_t out_apart) {
  for (std::size_t n = 0; n < 8 * lines; ++n)
    out[n / 8 * out_apart + n % 8] =
        mask[n / 8] >> (n % 8) & 1
            ? static_cast<Chain>(std::ceil((level - u[n / 8 * u_apart + n % 8]) * (1 / kChainUnit)))
            : kChainFar;
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

}  // namespace h6::kernels
