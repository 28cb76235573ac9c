// chain_step.h - lengths of chains of neighbouring nodes, one step at a time, in 16-bit numbers.
//
// Lengths are in 1/256 voxel, and steps of 1, sqrt 2 and sqrt 3 voxels are rounded up: a chain is
// never said to be shorter than it is. A brick is 8 x 8 x 8 nodes, x fastest.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

using Chain = std::int16_t;
inline constexpr float kChainUnit = 1.0f / 256;  // [voxel]
inline constexpr Chain kChainFar = 24000;
inline constexpr int kChainStep[4] = {0, 256, 363, 444};

// A brick and one layer around it: node (x,y,z) at v[z+1][y+1][x+1].
struct ChainBrick {
  alignas(64) Chain v[10][10][16];
};

// `steps` times for all nodes of the brick: the least of the node's own length and its 26
// neighbours' plus a step, at most far. What is around the brick stays as it is. `out`: the brick.
void chain_step(const ChainBrick& brick, int steps, Chain* out);
void chain_step_ref(const ChainBrick& brick, int steps, Chain* out);

// `lines` times 8 nodes: level - u [voxel] rounded up where the mask has a bit, else far. The next
// line is `u_apart` and `out_apart` further. |level - u| < 90.
void chain_seeds(const float* u, std::size_t u_apart, const std::uint8_t* mask, std::size_t lines,
                 float level, Chain* out, std::size_t out_apart);
void chain_seeds_ref(const float* u, std::size_t u_apart, const std::uint8_t* mask,
                     std::size_t lines, float level, Chain* out, std::size_t out_apart);

// What the chains of a brick tell of the side its nodes are on, bit 8*y + x of word z; none of it
// where a chain is far.
struct ChainSides {
  std::uint64_t in_sight[8];  // length < u + offset
  std::uint64_t dented[8];    // of those: (length - slack) / crooked > max(offset - u, 0)
  std::uint64_t close[8];     // of the others: u <= close
};
struct ChainLimits {
  float offset, slack, crooked, close;  // [voxel]; crooked: a ratio
};
void chain_sides(const Chain* chain, const float* u, const ChainLimits& limits, ChainSides& out);
void chain_sides_ref(const Chain* chain, const float* u, const ChainLimits& limits,
                     ChainSides& out);

}  // namespace h6::kernels
