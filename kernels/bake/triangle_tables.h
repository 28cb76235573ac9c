// SPDX-License-Identifier: Apache-2.0
// triangle_tables.h - positions of blocks and bricks, and tolerances of float work, shared by the
// fast kernels of triangle_distance.h.
#pragma once
#include <cstddef>

#include "kernels/bake/triangle_distance.h"

namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;  // nodes: 4 x 2 x 2
inline constexpr std::size_t kBlocks = kBrickSamples / kBlock;
inline constexpr float kBlockHalf[3] = {1.5f, 0.5f, 0.5f};
inline constexpr float kRadius = 1.6584f;       // |kBlockHalf|, rounded up
inline constexpr float kBrickRadius = 6.0622f;  // 3.5 sqrt(3), rounded up
inline constexpr std::size_t kFunctions = 7;
inline constexpr std::size_t kPlanes = 16;
inline constexpr float kNobodyNear = 1e30f;
inline constexpr float kRounding = 1e-4f;  // above the error of float work [voxel]
inline constexpr float kLeeway = 1e-2f;    // added to regions [voxel]

// x fastest within a block and among blocks.
struct BlockNodes {
  alignas(64) float middle_x[kBlocks], middle_y[kBlocks], middle_z[kBlocks];
  alignas(64) float in_x[kBlock], in_y[kBlock], in_z[kBlock];  // from the middle of a block
};

constexpr BlockNodes block_nodes() {
  BlockNodes m{};
  for (std::size_t n = 0; n < kBlock; ++n) {
    m.in_x[n] = float(n % 4) - kBlockHalf[0];
    m.in_y[n] = float(n / 4 % 2) - kBlockHalf[1];
    m.in_z[n] = float(n / 8) - kBlockHalf[2];
  }
  for (std::size_t b = 0; b < kBlocks; ++b) {
    m.middle_x[b] = float(4 * (b % 2)) + kBlockHalf[0];
    m.middle_y[b] = float(2 * (b / 2 % 4)) + kBlockHalf[1];
    m.middle_z[b] = float(2 * (b / 8)) + kBlockHalf[2];
  }
  return m;
}
inline constexpr BlockNodes kNodes = block_nodes();

// Middles of the 64 bricks of a tile.
struct TileBricks {
  alignas(64) float x[64], y[64], z[64];
};
constexpr TileBricks tile_bricks() {
  TileBricks t{};
  for (std::size_t b = 0; b < 64; ++b) {
    t.x[b] = float(8 * (b % 4)) + 3.5f;
    t.y[b] = float(8 * (b / 4 % 4)) + 3.5f;
    t.z[b] = float(8 * (b / 16)) + 3.5f;
  }
  return t;
}
inline constexpr TileBricks kTile = tile_bricks();

}  // namespace h6::kernels
