// SPDX-License-Identifier: Apache-2.0
// chain_step.h - lengths of chains of neighbouring nodes, one step at a time, in 16-bit numbers.
//
// Lengths are in 1/256 voxel. Steps of 1, sqrt 2 and sqrt 3 voxels are rounded up, so a length is
// never too short. A brick is 8 x 8 x 8 nodes, x fastest.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

using Chain = std::int16_t;
inline constexpr float kChainUnit = 1.0f / 256;  // [voxel]
inline constexpr Chain kChainFar = 24000;
inline constexpr int kChainStep[4] = {0, 256, 363, 444};

// One step for all nodes of a brick: the least of the node's own length and those of its 26
// neighbours plus a step, at most far. `from` is the first node; the next line of nodes is `line`
// further, the next layer `layer`. The nodes around the brick must be readable; they are not
// changed. `to` has a layout of the same kind and is `from` itself or does not overlap it. Returns
// whether a length has changed.
bool chain_step(const Chain* from, std::size_t line, std::size_t layer, Chain* to,
                std::size_t to_line, std::size_t to_layer);
bool chain_step_ref(const Chain* from, std::size_t line, std::size_t layer, Chain* to,
                    std::size_t to_line, std::size_t to_layer);

// Lengths at `layers` x `lines` x 8 nodes of a brick: level - u [voxel], rounded up, where the mask
// (bit 8*y + x of word z) has a bit; elsewhere level + u if `through`, else far. `u` points to the
// first of these nodes in the array of a brick. |level +- u| < 90.
struct ChainSeeds {
  float level;  // [voxel]
  bool through;
  int layers = 8, lines = 8;
};
void chain_seeds(const float* u, const std::uint64_t* mask, const ChainSeeds& seeds, Chain* to,
                 std::size_t to_line, std::size_t to_layer);
void chain_seeds_ref(const float* u, const std::uint64_t* mask, const ChainSeeds& seeds, Chain* to,
                     std::size_t to_line, std::size_t to_layer);

// How the chains of a brick decide the side of its nodes: bit 8*y + x of word z. No bit is set
// where a chain is far.
struct ChainSides {
  std::uint64_t in_sight[8];  // length < u + offset
  std::uint64_t dented[8];    // and (length - slack) / crooked > max(offset - u, 0)
  std::uint64_t close[8];     // not in sight, and u <= close
};
struct ChainLimits {
  float offset, slack, crooked, close;  // [voxel]; crooked: a ratio
};
void chain_sides(const Chain* chain, const float* u, const ChainLimits& limits, ChainSides& out);
void chain_sides_ref(const Chain* chain, const float* u, const ChainLimits& limits,
                     ChainSides& out);

// The neighbour (13 + dx + 3*dy + 9*dz) from which the shortest chain reaches a node: the first
// with the least length plus step, or 13 when all are far. Written for whole lines of nodes that
// have a bit in the mask (bit 8*y + x of word z); the other lines of `nearest` (512) are left as
// they are.
void chain_nearest(const Chain* from, std::size_t line, std::size_t layer,
                   const std::uint64_t* mask, std::uint8_t* nearest);
void chain_nearest_ref(const Chain* from, std::size_t line, std::size_t layer,
                       const std::uint64_t* mask, std::uint8_t* nearest);

}  // namespace h6::kernels
