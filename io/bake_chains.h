// bake_chains.h - how far nodes are from the reached set along chains of neighbours. Private to
// bake_*.cpp; bake_inside.cpp says what for.
#pragma once
#include "io/bake_grid.h"
#include "kernels/chain_step.h"

namespace h6::io::bake {

using kernels::Chain;
using kernels::kChainFar;
using kernels::kChainUnit;

// Chains start at a node, not on the border of R [voxel]: by this much they are too long at most,
// where R is flat; and where it is a crease or a corner, sqrt(3) - 1.
inline constexpr float kSlack = 0.15f, kCornerSlack = 0.74f;
inline constexpr float kCrooked = 1.135f;  // longest chain over straight line, rounding included

// A brick and its 26 neighbours: entry 13 + dx + 3*dy + 9*dz.
struct Around {
  std::array<std::int32_t, 27> row;  // -1: no row
  std::array<bool, 27> outside;      // where there is no row: all reached; beyond the grid it is
  Around(const Grid& grid, const NarrowBand& band, const Reached& reached, std::size_t r);
  // Where a node lies whose coordinates leave the brick by at most 8.
  static std::size_t entry(int x, int y, int z) {
    return std::size_t(13 + ((x + 8) / 8 - 1) + 3 * ((y + 8) / 8 - 1) + 9 * ((z + 8) / 8 - 1));
  }
};

inline constexpr NodeMask kAllNodes{{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull}};

// The nodes of the middle brick that have one of the given nodes among the 27 around them.
// `mask(i)`: those of neighbour i.
template <class Mask>
NodeMask spread(const Around&, Mask&& mask) {
  constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
  std::uint64_t layer[10];  // z = -1 .. 8, spread along x and y
  for (int z = -1; z <= 8; ++z) {
    const int dz = z < 0 ? -1 : z > 7 ? 1 : 0;
    const std::size_t at = std::size_t(z & 7);
    std::uint64_t low = 0, mid = 0, high = 0;  // rows y = -1, 0 .. 7, 8, spread along x
    for (int dy = -1; dy <= 1; ++dy) {
      const std::size_t i = std::size_t(13 + 3 * dy + 9 * dz);
      const std::uint64_t left = mask(i - 1).z[at], own = mask(i).z[at], right = mask(i + 1).z[at];
      const std::uint64_t along = own | (own & kNotX7) << 1 | (own & kNotX0) >> 1 |
                                  (left >> 7 & 0x0101010101010101) |
                                  (right & 0x0101010101010101) << 7;
      (dy < 0 ? low : dy > 0 ? high : mid) = along;
    }
    layer[z + 1] = mid | mid << 8 | mid >> 8 | low >> 56 | high << 56;
  }
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z) out.z[z] = layer[z] | layer[z + 1] | layer[z + 2];
  return out;
}

// The rows of a tile, in order.
template <class F>
void each_row(const Grid& grid, const NarrowBand& band, std::size_t tile, F&& f) {
  const std::array<int, 3> low = band.tiles.first_brick(tile);
  int high[3];
  for (std::size_t k = 0; k < 3; ++k) high[k] = std::min(low[k] + 4, grid.bricks[k]);
  for (int c = low[2]; c < high[2]; ++c)
    for (int b = low[1]; b < high[1]; ++b)
      for (int a = low[0]; a < high[0]; ++a)
        if (const std::int32_t r = band.row[grid.cell(a, b, c)]; r >= 0) f(std::size_t(r));
}

// Chains of some rows, tile by tile: tiles of one parity are never neighbours and the rows of a
// tile have an order, so a pass over the eight parities gives the same result on any number of
// threads. A pass is at least three steps.
inline constexpr int kStepsAPass = 3;
class Chains {
 public:
  // `buried`: which rows have a buried sheet in or beside them, read by `pass` too; through the
  // others chains go where they are not held. Without it they do not.
  Chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
         const std::vector<std::uint8_t>& rows, unsigned threads,
         const std::vector<std::uint8_t>* buried = nullptr);
  void pass();
  bool holds(std::size_t row) const { return slot_[row] >= 0; }
  bool some(std::size_t row) const { return some_[std::size_t(slot_[row])] != 0; }
  const Chain* nodes(std::size_t row) const {
    return chain_.data() + std::size_t(slot_[row]) * kBrickSamples;
  }

 private:
  const Grid& grid_;
  const NarrowBand& band_;
  const Reached& reached_;
  const std::vector<std::uint8_t>* buried_;
  unsigned threads_;
  std::vector<std::int32_t> slot_;  // (rows) or -1
  std::vector<Chain, SampleAllocator<Chain>> chain_;
  std::vector<std::uint8_t> some_;  // (slots) whether the row may have a chain at all
  std::array<std::vector<std::uint32_t>, 8> tiles_;  // that have such rows, by parity
};

// What is known around a brick: chains of rows that are held, and of the others the reached nodes.
// `wanted`: bit i for neighbour i; the others' nodes are as if nothing were reached there. False:
// there is no chain at all, all is far.
inline constexpr std::uint32_t kAround = (1u << 27) - 1;
// `through`: neighbours whose nodes that are not reached count too, u + offset from R: the sheets
// in and beside them border R.
bool gather_chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
                   const Chains* chains, const Around& around, std::uint32_t wanted,
                   std::uint32_t through, kernels::ChainBrick& out);

}  // namespace h6::io::bake
