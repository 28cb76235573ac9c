// SPDX-License-Identifier: Apache-2.0
// sign_brick.h - turns unsigned distances into the signed samples of a brick of 8 x 8 x 8 nodes.
//
// io/bake/inside.cpp defines the samples. Masks are bit 8*y + x of word z.
#pragma once
#include <cstdint>

#include "kernels/bake/chain_step.h"

namespace h6::kernels {

struct BrickSides {
  const std::uint64_t* reached;   // from outside
  const std::uint64_t* in_sight;  // not reached, but on the outer side of a sheet
  const Chain* chain;             // lengths of the chains to the outside, or null
  bool corrected;                 // chains may correct the depth behind a sheet too
};
struct SignLimits {
  float offset, slack, corner_slack, crooked;  // [voxel]; crooked: a ratio
  float voxel;                                 // [m]
};
// `u` [voxel] and `out` [m]: 512; they may be the same.
//   reached             u - offset
//   in sight            min(u - offset, 0), or by a chain shorter than u + offset
//                       -max((chain - slack) / crooked, offset - u, 0)
//   else                -(u + offset), or by a chain at least as long, where corrected,
//                       -max((chain - corner_slack) / crooked, u + offset)
void sign_brick(const float* u, const BrickSides& sides, const SignLimits& limits, float* out);
void sign_brick_ref(const float* u, const BrickSides& sides, const SignLimits& limits, float* out);

}  // namespace h6::kernels
