// SPDX-License-Identifier: Apache-2.0
// sign.cpp - the outside: the nodes that a flood (flood.h) reaches from the border.
//
// A node is passable if u > offset and it is not on the surface.
#include <algorithm>

#include "io/bake/flood.h"
#include "io/bake/pockets.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

using namespace flooding;

// Regions by nesting: 0 is outside, 1 behind one wall, 2 behind two, ... A wall is what the flood
// cannot pass: crossed edges and nodes that are not passable. Regions of even depth are empty.
Reached open_cavities(const Grid& grid, const NarrowBand& band, const Masks& free, unsigned threads,
                      Flood& flood) {
  Reached empty{flood.wet(), {}};
  Masks last = flood.wet(), wall(band.rows());
  for (std::size_t r = 0; r < band.rows(); ++r) wall[r] = ~free[r];
  Flood walls(grid, band, wall, Flood::Edges::open, threads, Flood::Over::rows);
  for (std::uint8_t depth = 1; depth < 250; ++depth) {
    Masks seeds = neighbours(grid, band, last, threads);
    const Masks before_wall = walls.wet();
    walls.from_nodes(seeds, 1);
    Masks crossed = walls.wet();
    for (std::size_t r = 0; r < crossed.size(); ++r) crossed[r] = crossed[r] & ~before_wall[r];
    const Masks behind = neighbours(grid, band, crossed, threads);
    for (std::size_t r = 0; r < seeds.size(); ++r) seeds[r] = seeds[r] | behind[r];
    last = flood.wet();
    if (!flood.from_nodes(seeds, std::uint8_t(depth + 1))) break;
    for (std::size_t r = 0; r < last.size(); ++r) {
      last[r] = flood.wet()[r] & ~last[r];
      if (depth % 2 == 0) empty.node[r] = empty.node[r] | last[r];
    }
  }
  for (std::uint8_t& tag : flood.cells()) tag &= 1;  // depth + 1 is odd where it is empty
  empty.cell = std::move(flood.cells());
  return empty;
}

// Dry nodes that are not connected with a roomy one, which has six free edges to dry nodes. They
// are bottoms of grooves or tips of solids.
std::vector<RowNodes> cramped_nodes(const Grid& grid, const NarrowBand& band, const Masks& dry,
                                    unsigned threads) {
  Masks roomy(dry.size());
  sched::parallel_for(dry.size(), threads, [&](std::size_t r) {
    roomy[r] = dry[r];
    if (!dry[r].any()) return;
    const std::array<int, 3> at = grid.place(band.cell[r]);
    const Crossing& own = band.crossing[r];
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        // Nodes that have a free edge to a dry neighbour, in this brick or the next one.
        NodeMask linked = step > 0 ? before(dry[r], axis) & ~own.edge[axis]
                                   : after(dry[r] & ~own.edge[axis], axis);
        std::array<int, 3> to = at;
        to[axis] += step;
        const bool in = to[axis] >= 0 && to[axis] < grid.bricks[axis];
        const std::int32_t next = in ? band.row[grid.cell(to[0], to[1], to[2])] : -1;
        const NodeMask& there = next >= 0 ? dry[std::size_t(next)] : kAllNodes;
        const Crossing& theirs = next >= 0 ? band.crossing[std::size_t(next)] : kOpenEdges;
        const NodeMask across = through(there, step > 0 ? kOpenEdges : theirs, axis, -step);
        linked = linked | (step > 0 ? across & ~own.edge[axis] : across);
        roomy[r] = roomy[r] & linked;
      }
  });
  Flood solid(grid, band, dry, Flood::Edges::cut, threads, Flood::Over::rows);
  solid.from_nodes(roomy, 1);
  std::vector<RowNodes> cramped;
  for (std::size_t r = 0; r < dry.size(); ++r)
    if (const NodeMask left = dry[r] & ~solid.wet()[r]; left.any())
      cramped.push_back({std::uint32_t(r), left});
  return cramped;
}

void reach_pockets(const Surface& surface, const Grid& grid, const NarrowBand& band,
                   const Masks& free, unsigned threads, Flood& outside,
                   std::vector<std::uint32_t>& unsure) {
  Masks dry(band.rows());
  sched::parallel_for(dry.size(), threads,
                      [&](std::size_t r) { dry[r] = free[r] & ~outside.wet()[r]; });
  std::vector<RowNodes> cramped = cramped_nodes(grid, band, dry, threads);
  std::erase_if(cramped, [&](const RowNodes& nodes) {
    const std::uint32_t cell = band.cell[nodes.row];
    if (grid.wants(cell)) return false;
    unsure.push_back(cell);
    return true;
  });
  Pockets pockets(surface, grid, band, cramped, threads);
  constexpr int kRounds = 8;  // down a groove, a few voxels at a time
  const auto reach = [&](Pockets::By by) {
    return outside.from_nodes(pockets.reached(outside.wet(), by), 1);
  };
  for (int i = 0; i < kRounds; ++i) {
    for (int k = 0; k < kRounds && reach(Pockets::By::lines); ++k) {
    }
    if (!reach(Pockets::By::walks)) return;
  }
}

}  // namespace

Reached flood(const Surface& surface, const Grid& grid, const NarrowBand& band, Cavities cavities,
              unsigned threads) {
  const Masks& free = band.free;
  Flood outside(grid, band, free, Flood::Edges::cut, threads);
  outside.from_border();
  std::vector<std::uint32_t> unsure;
  // In a soup every crack would be a pocket, and parity has no meaning there, so pockets stay
  // inside.
  if (!band.crossing.empty() && surface.closed)
    reach_pockets(surface, grid, band, free, threads, outside, unsure);
  if (cavities == Cavities::hollow) {
    Reached empty = open_cavities(grid, band, free, threads, outside);
    empty.unsure = std::move(unsure);
    return empty;
  }
  return {outside.take_wet(), std::move(outside.cells()), std::move(unsure)};
}

std::vector<std::uint8_t> sides_of(const Grid& grid, const NarrowBand& band, const Reached& reached,
                                   unsigned threads) {
  std::vector<std::uint8_t> inside(grid.cells());
  const std::size_t layer = grid.cell(0, 0, 1);
  sched::parallel_for(std::size_t(grid.bricks[2]), threads, [&](std::size_t c) {
    for (std::size_t cell = c * layer; cell < (c + 1) * layer; ++cell) {
      const std::int32_t row = band.row[cell];
      if (row < 0) {
        inside[cell] = reached.cell[cell] == 0 ? 0xff : 0;
        continue;
      }
      const NodeMask& out = reached.node[std::size_t(row)];
      for (std::size_t i = 0; i < 8; ++i)
        inside[cell] |=
            std::uint8_t(!out.get(4 * (64 * (i >> 2) + 8 * (i >> 1 & 1) + (i & 1))) << i);
    }
  });
  return inside;
}

}  // namespace h6::io::bake
