// SPDX-License-Identifier: Apache-2.0
// chains.h - lengths of chains of neighbouring nodes to the reached set R. Private to this folder;
// inside.cpp explains their purpose.
#pragma once
#include "io/bake/grid.h"
#include "kernels/bake/chain_step.h"

namespace h6::io::bake {

using kernels::Chain;
using kernels::kChainFar;
using kernels::kChainUnit;

// Chains end at a node, not on the border of R. So they are too long [voxel] by at most kSlack
// where the border is flat, and by sqrt(3) - 1 where it has a crease or a corner.
inline constexpr float kSlack = 0.15f, kCornerSlack = 0.74f;
// The largest ratio of a chain's length to the straight line, with rounding.
inline constexpr float kCrooked = 1.135f;

// The rows of a tile and of the bricks around it. Bricks (a,b,c), from -1 to 4, have the place
// (6*(c + 1) + b + 1)*6 + a + 1.
struct TileRows {
  static constexpr int kSide = kernels::kTileBricks + 2;
  static constexpr std::size_t kPlaces = std::size_t(kSide) * kSide * kSide;
  std::array<std::int32_t, kPlaces> row;  // -1: no row
  std::array<bool, kPlaces> outside;      // bricks without a row: all in R, as beyond the grid
  TileRows(const Grid& grid, const NarrowBand& band, const Reached& reached, std::size_t tile);

  static constexpr std::size_t place(int a, int b, int c) {
    return std::size_t((kSide * (c + 1) + b + 1) * kSide + a + 1);
  }
  static constexpr std::array<int, 3> brick(std::size_t place) {
    const int at = int(place);
    return {at % kSide - 1, at / kSide % kSide - 1, at / (kSide * kSide) - 1};
  }
  // Steps of places to the neighbours 13 + dx + 3*dy + 9*dz.
  static constexpr std::array<int, 27> kBeside = [] {
    std::array<int, 27> by{};
    for (int i = 0; i < 27; ++i)
      by[std::size_t(i)] = (kSide * (i / 9 - 1) + i / 3 % 3 - 1) * kSide + i % 3 - 1;
    return by;
  }();
  // Calls f(place, row) for the tile's own rows, in order.
  template <class F>
  void each(F&& f) const {
    for (int c = 0; c < kernels::kTileBricks; ++c)
      for (int b = 0; b < kernels::kTileBricks; ++b)
        for (int a = 0; a < kernels::kTileBricks; ++a)
          if (const std::int32_t r = row[place(a, b, c)]; r >= 0) f(place(a, b, c), std::size_t(r));
  }
};

// A brick and its 26 neighbours: entry 13 + dx + 3*dy + 9*dz.
struct Around {
  std::array<std::int32_t, 27> row;
  std::array<bool, 27> outside;
  Around(const TileRows& rows, std::size_t place) {
    for (std::size_t i = 0; i < 27; ++i) {
      const std::size_t at = place + std::size_t(TileRows::kBeside[i]);
      row[i] = rows.row[at];
      outside[i] = rows.outside[at];
    }
  }
  // The entry of a node; its coordinates may leave the brick by up to 8.
  static std::size_t entry(int x, int y, int z) {
    return std::size_t(13 + ((x + 8) / 8 - 1) + 3 * ((y + 8) / 8 - 1) + 9 * ((z + 8) / 8 - 1));
  }
};

// The nodes of the middle brick that have one of the given nodes among the 27 around them,
// themselves included. `nodes[i]`: the given nodes of neighbour i.
inline NodeMask spread(const std::array<const NodeMask*, 27>& nodes) {
  constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
  std::uint64_t layer[10];  // z = -1 .. 8, spread along x and y
  for (int z = -1; z <= 8; ++z) {
    const int dz = z < 0 ? -1 : z > 7 ? 1 : 0;
    const std::size_t at = std::size_t(z & 7);
    std::uint64_t low = 0, mid = 0, high = 0;  // rows y = -1, 0 .. 7, 8, spread along x
    for (int dy = -1; dy <= 1; ++dy) {
      const std::size_t i = std::size_t(13 + 3 * dy + 9 * dz);
      const std::uint64_t left = nodes[i - 1]->z[at], own = nodes[i]->z[at],
                          right = nodes[i + 1]->z[at];
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

// Chains of some rows, tile by tile. Tiles of one parity are never neighbours, and the rows of a
// tile have an order, so a pass over the eight parities gives the same bits with any number of
// threads. A pass extends every chain that is not the shortest by one step at least.
class Chains {
 public:
  // `rows`: the rows that hold chains. `buried` (must outlive this): the rows with a buried sheet
  // in or beside them; chains pass through rows that neither hold chains nor are in `buried`.
  // Without `buried`, chains pass only through rows that hold chains.
  Chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
         const std::vector<std::uint8_t>& rows, unsigned threads,
         const std::vector<std::uint8_t>* buried = nullptr);
  bool pass();  // false: all chains are the shortest
  bool holds(std::size_t row) const { return slot_[row] >= 0; }
  bool some(std::size_t row) const { return some_[std::size_t(slot_[row])] != 0; }
  const Chain* nodes(std::size_t row) const {
    return chain_.data() + std::size_t(slot_[row]) * kBrickSamples;
  }

 private:
  bool pass_tile(std::size_t tile);  // whether a chain got shorter

  const Grid& grid_;
  const NarrowBand& band_;
  const Reached& reached_;
  const std::vector<std::uint8_t>* buried_;
  unsigned threads_;
  std::vector<std::int32_t> slot_;  // (rows) or -1; tile by tile
  std::vector<Chain, SampleAllocator<Chain>> chain_;
  std::vector<std::uint8_t> some_;  // (slots) whether the row may have a chain at all
  std::array<std::vector<std::uint32_t>, 8> tiles_;  // tiles with such rows, by parity
};

// The chains of a tile's nodes and of one layer of nodes around it; rows that are not held have
// chains at their nodes of R only. 0.1 MB.
class ChainRoom {
 public:
  static constexpr std::size_t kLine = 48, kLayer = kLine * 34;
  // A brick, and which of its neighbours are wanted: bits as in Around, 13 for itself.
  struct Wanted {
    std::size_t place;
    std::uint32_t around;
  };
  static constexpr std::uint32_t kAllAround = (1u << 27) - 1;
  // Fills the wanted bricks and the adjoining nodes of their neighbours; the rest is undefined.
  // With `through`, nodes outside R also get a chain of u + offset in rows that are neither held
  // nor marked in it: the sheets in and beside those rows border R.
  void fill(const Grid& grid, const NarrowBand& band, const Reached& reached, const Chains* chains,
            const TileRows& rows, const std::vector<Wanted>& bricks,
            const std::vector<std::uint8_t>* through);
  // The first node of a brick.
  Chain* first(std::size_t place) {
    const std::array<int, 3> at = TileRows::brick(place);
    return v_ + node(8 * at[0], 8 * at[1], 8 * at[2]);
  }

 private:
  struct Box;
  static constexpr std::size_t node(int x, int y, int z) {
    return std::size_t(z + 1) * kLayer + std::size_t(y + 1) * kLine + std::size_t(x + 8);
  }
  static constexpr std::array<Box, TileRows::kPlaces> make_boxes();
  void fill_with(const Box& box, Chain value);
  void copy(const Box& box, const Chain* from);
  void seed(const Box& box, const NodeMask& wet, const float* u, float offset, bool passes);

  alignas(64) Chain v_[kLayer * 34];
};

}  // namespace h6::io::bake
