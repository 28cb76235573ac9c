// bake_sign.cpp - what is outside: a flood over nodes, 64 at a time.
//
// A node is passable when u > offset and it is not on the surface; it is left through edges that no
// triangle crosses. Bricks without a row are all passable, so the flood takes them whole. The
// result is a set: the order of work does not show in it.
#include <algorithm>

#include "io/bake_grid.h"

namespace h6::io::bake {
namespace {

constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
constexpr std::uint64_t kX0 = 0x0101010101010101, kX7 = 0x8080808080808080;
constexpr std::uint64_t kY0 = 0xff, kY7 = std::uint64_t{0xff} << 56;

const Crossing kOpen{};

// Nodes of the face towards a neighbour, as nodes of the neighbour, through edges that are not cut.
NodeMask through(const NodeMask& nodes, const Crossing& edges, std::size_t axis, int step) {
  NodeMask in;
  const auto& cut = edges.edge[axis].z;
  const auto& from = nodes.z;
  for (std::size_t z = 0; z < 8; ++z) {
    if (axis == 0)
      in.z[z] = step > 0 ? (from[z] & ~cut[z] & kX7) >> 7 : ((from[z] & kX0) << 7) & ~cut[z];
    else if (axis == 1)
      in.z[z] = step > 0 ? (from[z] & ~cut[z] & kY7) >> 56 : ((from[z] & kY0) << 56) & ~cut[z];
  }
  if (axis == 2 && step > 0) in.z[0] = from[7] & ~cut[7];
  if (axis == 2 && step < 0) in.z[7] = from[0] & ~cut[7];
  return in;
}

NodeMask operator&(const NodeMask& a, const NodeMask& b) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = a.z[z] & b.z[z];
  return c;
}
NodeMask operator|(const NodeMask& a, const NodeMask& b) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = a.z[z] | b.z[z];
  return c;
}
NodeMask operator~(const NodeMask& a) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = ~a.z[z];
  return c;
}

// Each node's neighbour before or after it along an axis, within the brick.
NodeMask before(const NodeMask& m, std::size_t axis) {
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z)
    out.z[z] = axis == 0   ? (m.z[z] & kNotX0) >> 1
               : axis == 1 ? m.z[z] >> 8
               : z < 7     ? m.z[z + 1]
                           : 0;
  return out;
}
NodeMask after(const NodeMask& m, std::size_t axis) {
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z)
    out.z[z] = axis == 0   ? (m.z[z] & kNotX7) << 1
               : axis == 1 ? m.z[z] << 8
               : z > 0     ? m.z[z - 1]
                           : 0;
  return out;
}

using Masks = std::vector<NodeMask>;  // (rows)

Masks passable_nodes(const Grid& grid, const NarrowBand& band) {
  Masks free(band.rows());
  const float offset = float(grid.offset);
  for (std::size_t r = 0; r < band.rows(); ++r) {
    const float* u = band.nodes(r);
    for (std::size_t z = 0; z < 8; ++z)
      for (std::size_t n = 0; n < 64; ++n)
        free[r].z[z] |= std::uint64_t(u[64 * z + n] > offset) << n;
    if (!band.crossing.empty()) free[r] = free[r] & ~band.crossing[r].on;
  }
  return free;
}

class Flood {
 public:
  enum class Edges { cut, open };
  Flood(const Grid& grid, const NarrowBand& band, Masks free, Edges edges)
      : grid_(grid), band_(band), edges_(edges), free_(std::move(free)), wet_(band.rows()),
        new_(band.rows()), queued_(grid.cells(), 0), cell_(grid.cells(), 0) {}

  // From the first node of the grid: its border is all outside, and connected.
  void from_corner() {
    tag_ = 1;
    if (const std::int32_t r = band_.row[0]; r >= 0)
      new_[std::size_t(r)].set(0);
    else
      cell_[0] = 1;
    push(0);
    run();
  }

  // From more nodes, as far as they are passable and dry; false: none is. Bricks without a row that
  // are reached now get the tag.
  bool from_nodes(const Masks& seeds, std::uint8_t tag) {
    tag_ = tag;
    for (std::size_t r = 0; r < seeds.size(); ++r) {
      new_[r] = seeds[r] & free_[r] & ~wet_[r];
      if (new_[r].any()) push(band_.cell[r]);
    }
    const bool any = !queue_.empty();
    run();
    return any;
  }

  const Masks& wet() const { return wet_; }
  std::vector<std::uint8_t>& cells() { return cell_; }

 private:
  const Crossing& crossing(std::size_t r) const {
    return edges_ == Edges::open || band_.crossing.empty() ? kOpen : band_.crossing[r];
  }
  void push(std::size_t cell) {
    if (queued_[cell]) return;
    queued_[cell] = 1;
    queue_.push_back(std::uint32_t(cell));
  }

  void run() {
    while (!queue_.empty()) {
      const std::size_t cell = queue_.back();
      queue_.pop_back();
      queued_[cell] = 0;
      const std::int32_t r = band_.row[cell];
      if (r >= 0) {
        spread(std::size_t(r));
        spill(cell, wet_[std::size_t(r)], crossing(std::size_t(r)));
      } else {
        NodeMask full;
        full.z.fill(~std::uint64_t{0});
        spill(cell, full, kOpen);
      }
    }
  }

  // Inside one brick, until nothing changes.
  void spread(std::size_t r) {
    const Crossing& c = crossing(r);
    const auto& pass = free_[r].z;
    auto& wet = wet_[r].z;
    for (std::size_t z = 0; z < 8; ++z) wet[z] |= new_[r].z[z];
    new_[r] = {};
    bool changed = true;
    const auto flow = [&](std::size_t z) {
      std::uint64_t w = wet[z], before;
      const std::uint64_t ex = c.edge[0].z[z], ey = c.edge[1].z[z];
      do {
        before = w;
        w |= ((w & ~ex & kNotX7) << 1) & pass[z];
        w |= ((w & kNotX0) >> 1) & ~ex & pass[z];
        w |= ((w & ~ey) << 8) & pass[z];
        w |= (w >> 8) & ~ey & pass[z];
      } while (w != before);
      if (w != wet[z]) changed = true;
      wet[z] = w;
    };
    while (changed) {
      changed = false;
      for (std::size_t z = 0; z < 8; ++z) {
        if (z > 0) pour(wet[z], wet[z - 1] & ~c.edge[2].z[z - 1] & pass[z], changed);
        flow(z);
      }
      for (std::size_t z = 7; z-- > 0;) {
        pour(wet[z], wet[z + 1] & ~c.edge[2].z[z] & pass[z], changed);
        flow(z);
      }
    }
  }
  static void pour(std::uint64_t& into, std::uint64_t bits, bool& changed) {
    changed |= (bits & ~into) != 0;
    into |= bits;
  }

  // Into the six neighbours.
  void spill(std::size_t cell, const NodeMask& wet, const Crossing& own) {
    const std::array<int, 3> at = grid_.place(cell);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        std::array<int, 3> to = at;
        to[axis] += step;
        if (to[axis] < 0 || to[axis] >= grid_.bricks[axis]) continue;
        const std::size_t next = grid_.cell(to[0], to[1], to[2]);
        const std::int32_t r = band_.row[next];
        // The edge between two bricks belongs to the lower one.
        const Crossing& edges = step > 0 ? own : r >= 0 ? crossing(std::size_t(r)) : kOpen;
        if (r < 0) {
          if (cell_[next] || !through(wet, edges, axis, step).any()) continue;
          cell_[next] = tag_;
          push(next);
          continue;
        }
        const NodeMask in = through(wet, edges, axis, step);
        bool any = false;
        for (std::size_t z = 0; z < 8; ++z) {
          const std::uint64_t bits =
              in.z[z] & free_[std::size_t(r)].z[z] & ~wet_[std::size_t(r)].z[z];
          new_[std::size_t(r)].z[z] |= bits;
          any |= bits != 0;
        }
        if (any) push(next);
      }
  }

  const Grid& grid_;
  const NarrowBand& band_;
  Edges edges_;
  Masks free_, wet_, new_;
  std::vector<std::uint8_t> queued_, cell_;  // (cells)
  std::vector<std::uint32_t> queue_;
  std::uint8_t tag_ = 0;
};

// The six neighbours of each node, rows only: walls are never farther away than that.
Masks neighbours(const Grid& grid, const NarrowBand& band, const Masks& nodes) {
  Masks out(nodes.size());
  for (std::size_t r = 0; r < nodes.size(); ++r) {
    if (!nodes[r].any()) continue;
    const auto& from = nodes[r].z;
    auto& own = out[r].z;
    for (std::size_t z = 0; z < 8; ++z) {
      own[z] |= (from[z] & kNotX7) << 1 | (from[z] & kNotX0) >> 1 | from[z] << 8 | from[z] >> 8;
      if (z > 0) own[z] |= from[z - 1];
      if (z < 7) own[z] |= from[z + 1];
    }
    const std::array<int, 3> at = grid.place(band.cell[r]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        std::array<int, 3> to = at;
        to[axis] += step;
        if (to[axis] < 0 || to[axis] >= grid.bricks[axis]) continue;
        const std::int32_t next = band.row[grid.cell(to[0], to[1], to[2])];
        if (next < 0) continue;
        NodeMask& there = out[std::size_t(next)];
        there = there | through(nodes[r], kOpen, axis, step);
      }
  }
  return out;
}

// Regions by nesting: 0 outside, 1 behind one wall, 2 behind two, ... A wall is what the flood
// cannot
// pass: crossed edges and the nodes that are not passable. Even regions are empty.
Reached open_cavities(const Grid& grid, const NarrowBand& band, const Masks& free, Flood& flood) {
  Reached empty{flood.wet(), {}};
  Masks last = flood.wet(), wall(band.rows());
  for (std::size_t r = 0; r < band.rows(); ++r) wall[r] = ~free[r];
  Flood walls(grid, band, std::move(wall), Flood::Edges::open);
  std::fill(walls.cells().begin(), walls.cells().end(), std::uint8_t{1});  // rows only
  for (std::uint8_t depth = 1; depth < 250; ++depth) {
    Masks seeds = neighbours(grid, band, last);
    const Masks before_wall = walls.wet();
    walls.from_nodes(seeds, 1);
    Masks crossed = walls.wet();
    for (std::size_t r = 0; r < crossed.size(); ++r) crossed[r] = crossed[r] & ~before_wall[r];
    const Masks behind = neighbours(grid, band, crossed);
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

// Dry nodes that hang together with no roomy place, a node with six free edges to dry nodes:
// bottoms of grooves, and tips of solids.
Masks cramped_nodes(const Grid& grid, const NarrowBand& band, const Masks& dry) {
  Masks roomy(dry);
  for (std::size_t r = 0; r < dry.size(); ++r) {
    if (!dry[r].any()) continue;
    const std::array<int, 3> at = grid.place(band.cell[r]);
    const Crossing& own = band.crossing[r];
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        // Dry nodes of this brick and its neighbour, moved to the node they are the neighbour of.
        NodeMask linked = step > 0 ? before(dry[r], axis) & ~own.edge[axis]
                                   : after(dry[r] & ~own.edge[axis], axis);
        std::array<int, 3> to = at;
        to[axis] += step;
        const bool in = to[axis] >= 0 && to[axis] < grid.bricks[axis];
        const std::int32_t next = in ? band.row[grid.cell(to[0], to[1], to[2])] : -1;
        NodeMask full;
        full.z.fill(~std::uint64_t{0});
        const NodeMask& there = next >= 0 ? dry[std::size_t(next)] : full;
        const Crossing& theirs = next >= 0 ? band.crossing[std::size_t(next)] : kOpen;
        const NodeMask across = through(there, step > 0 ? kOpen : theirs, axis, -step);
        linked = linked | (step > 0 ? across & ~own.edge[axis] : across);
        roomy[r] = roomy[r] & linked;
      }
  }
  Flood solid(grid, band, dry, Flood::Edges::cut);
  std::fill(solid.cells().begin(), solid.cells().end(), std::uint8_t{1});  // rows only
  solid.from_nodes(roomy, 1);
  for (std::size_t r = 0; r < dry.size(); ++r) roomy[r] = dry[r] & ~solid.wet()[r];
  return roomy;
}

void reach_pockets(const Surface& surface, const Grid& grid, const NarrowBand& band,
                   const Masks& free, unsigned threads, Flood& outside) {
  Masks dry(band.rows());
  for (std::size_t r = 0; r < dry.size(); ++r) dry[r] = free[r] & ~outside.wet()[r];
  const Masks candidates = cramped_nodes(grid, band, dry);
  constexpr int kRounds = 8;  // down a groove, a few voxels at a time
  for (int i = 0; i < kRounds; ++i) {
    Masks left(candidates);
    for (std::size_t r = 0; r < left.size(); ++r) left[r] = left[r] & ~outside.wet()[r];
    if (!outside.from_nodes(reachable(surface, grid, band, left, outside.wet(), threads), 1))
      return;
  }
}

}  // namespace

Reached flood(const Surface& surface, const Grid& grid, const NarrowBand& band, Cavities cavities,
              unsigned threads) {
  const Masks free = passable_nodes(grid, band);
  Flood outside(grid, band, free, Flood::Edges::cut);
  outside.from_corner();
  if (!band.crossing.empty()) reach_pockets(surface, grid, band, free, threads, outside);
  if (cavities == Cavities::hollow) return open_cavities(grid, band, free, outside);
  return {outside.wet(), std::move(outside.cells())};
}

}  // namespace h6::io::bake
