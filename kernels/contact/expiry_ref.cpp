// SPDX-License-Identifier: Apache-2.0
// expiry_ref.cpp - the specification of expiry.
#include <algorithm>
#include <cmath>

#include "kernels/contact/expiry.h"

namespace h6::kernels {

std::size_t travel_blocks_ref(const SpheresView& blocks, const Motion& motion, const float* expiry,
                              float margin, float* way, float* now, float* from,
                              std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t b = 0; b < blocks.count; ++b) {
    float square = 0;
    for (const float* m : motion.change.m) {
      const float d = m[0] * blocks.x[b] + (m[1] * blocks.y[b] + (m[2] * blocks.z[b] + m[3]));
      square += d * d;
    }
    const float bound = std::sqrt(square) + (motion.turn * blocks.radius[b] + motion.more);
    const float moved = std::min(motion.most, bound);
    now[b] = way[b] + moved;
    from[b] = way[b] - moved;
    if (motion.settles) way[b] = now[b] = from[b] = now[b] + now[b] * kRoundUp;
    if (expiry[b] <= now[b] + margin) out[written++] = static_cast<std::uint32_t>(b);
  }
  return written;
}

std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        const float* now, float margin, std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t i = kBlock * blocks[k]; i < kBlock * (blocks[k] + 1); ++i)
      if (values[i] <= now[blocks[k]] + margin) out[written++] = static_cast<std::uint32_t>(i);
  return written;
}

void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out) {
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    out[blocks[k]] = *std::min_element(first, first + kBlock);
  }
}

}  // namespace h6::kernels
