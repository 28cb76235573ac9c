// SPDX-License-Identifier: Apache-2.0
// lattice_hits.h - finds where the lines of a tile's lattice meet a triangle.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

// Nodes are one voxel apart, 32 along a side of a tile; coordinates are integers of 2^-18 voxel
// from its first node. Sums of products of two of them below 2^25 are exact in double.
inline constexpr std::size_t kLatticeSide = 32;
inline constexpr double kLatticeVoxel = 262144;
inline constexpr std::int32_t kLatticeMost = 1 << 24;  // a corner is less than this from the node

// Lines along axis a pass through node j of axis (a + 1) % 3 and node k of axis (a + 2) % 3.
struct LatticeHits {
  // By axis: the number of hits, and how a slot encodes its line.
  std::size_t count[3], shift[3];
  // Slots of the lines that meet the triangle, in the order of k, then j; line (j, k) along axis a
  // has slot (k - first[(a + 2) % 3]) << shift[a] | (j - first[(a + 1) % 3]). There is room for one
  // vector more.
  alignas(64) std::uint32_t slot[3][kLatticeSide * kLatticeSide + 8];
  // By slot: the coordinate along the axis [voxel] where the line meets the triangle, to within
  // 1e-11 while it is below 2048. Unspecified for lines that do not meet the triangle.
  alignas(64) double at[3][kLatticeSide * kLatticeSide + 8];
};

inline std::size_t lattice_shift(std::int32_t columns) {
  return columns <= 8 ? 3 : columns <= 16 ? 4 : 5;
}

// The lines through nodes first[k] .. last[k] of axis k (nodes of the tile) that meet the triangle,
// its border INCLUDED. A triangle parallel to an axis meets no line along that axis.
void lattice_hits(const std::int32_t corner[3][3], const std::int32_t first[3],
                  const std::int32_t last[3], LatticeHits& hits);
void lattice_hits_ref(const std::int32_t corner[3][3], const std::int32_t first[3],
                      const std::int32_t last[3], LatticeHits& hits);

}  // namespace h6::kernels
