// SPDX-License-Identifier: Apache-2.0
// expiry.h - how far each block of a shell has travelled, and which groups have expired by that.
//
// Traversal keeps an expiry for every group of points: the way that its block of 16 groups may
// travel before the group can touch. Few groups expire in a frame.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;
inline constexpr float kRoundUp = 0x1p-23f;  // makes up for the rounding of a sum of two floats

// How a shell moved in a field since its anchor.
struct Motion {
  Affine change;  // its map to the field, less that of the anchor [voxel/m], [voxel]
  float turn;     // >= the length of the matrix in `change` [voxel/m]
  float more;     // what rounding and bending may add to the way of a point [voxel]
  float most;     // no point moved farther [voxel]
  bool settles;   // the place becomes the new anchor
};

// No point of block b, which lies in the sphere (c, r), moved farther than
//     a = min(most, |change (c, 1)| + turn r + more)
// way[b] is the way up to the anchor. If the motion settles, way[b] grows by a, rounded up, and
// now = from = way; else now = way + a and from = way - a. Writes to `out`, in order, the blocks
// with expiry[b] <= now[b] + margin, and returns their number. All columns but `out` are readable
// and writable to a multiple of 16 rows; blocks.count is one.
std::size_t travel_blocks(const SpheresView& blocks, const Motion& motion, const float* expiry,
                          float margin, float* way, float* now, float* from, std::uint32_t* out);
std::size_t travel_blocks_ref(const SpheresView& blocks, const Motion& motion, const float* expiry,
                              float margin, float* way, float* now, float* from,
                              std::uint32_t* out);

// Writes to `out`, in order, every index 16 b + i with values[16 b + i] <= now[b] + margin, for the
// blocks b = blocks[0..count-1]. `out` has room for 16 count. Returns the number of indices.
std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count,
                    const float* now, float margin, std::uint32_t* out);
std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        const float* now, float margin, std::uint32_t* out);

// out[blocks[k]] = the least of the block's 16 values. No NaN.
void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out);
void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out);

}  // namespace h6::kernels
