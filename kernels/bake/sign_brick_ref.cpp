// SPDX-License-Identifier: Apache-2.0
// sign_brick_ref.cpp - the specification of sign_brick.
#include <algorithm>

#include "kernels/bake/sign_brick.h"

namespace h6::kernels {

void sign_brick_ref(const float* u, const BrickSides& sides, const SignLimits& limits, float* out) {
  for (int n = 0; n < 512; ++n) {
    const bool reached = sides.reached[n / 64] >> (n % 64) & 1;
    const bool in_sight = sides.in_sight[n / 64] >> (n % 64) & 1;
    const float sheet = u[n] + limits.offset;
    float d = reached    ? u[n] - limits.offset
              : in_sight ? std::min(u[n] - limits.offset, 0.0f)
                         : -sheet;
    if (!reached && sides.chain != nullptr && sides.chain[n] < kChainFar) {
      const float way = float(sides.chain[n]) * kChainUnit;
      if (in_sight && way < sheet)
        d = -std::max((way - limits.slack) / limits.crooked, std::max(limits.offset - u[n], 0.0f));
      else if (!in_sight && way >= sheet && sides.corrected)
        d = -std::max((way - limits.corner_slack) / limits.crooked, sheet);
    }
    out[n] = d * limits.voxel;
  }
}

}  // namespace h6::kernels
