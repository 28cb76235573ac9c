// bake_flood.h - what water reaches over nodes, 64 at a time. Private to bake_*.cpp.
//
// A node is passable when its mask says so; it is left through edges that no triangle crosses.
// Bricks without a row are all passable, so the flood takes them whole. The result is a set: the
// order of work does not show in it.
#pragma once
#include <algorithm>

#include "io/bake_grid.h"

namespace h6::io::bake::flooding {

inline constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
inline constexpr std::uint64_t kX0 = 0x0101010101010101, kX7 = 0x8080808080808080;
inline constexpr std::uint64_t kY0 = 0xff, kY7 = std::uint64_t{0xff} << 56;

inline const Crossing kOpen{};

// Nodes of the face towards a neighbour, as nodes of the neighbour, through edges that are not cut.
inline NodeMask through(const NodeMask& nodes, const Crossing& edges, std::size_t axis, int step) {
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

inline NodeMask operator&(const NodeMask& a, const NodeMask& b) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = a.z[z] & b.z[z];
  return c;
}
inline NodeMask operator|(const NodeMask& a, const NodeMask& b) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = a.z[z] | b.z[z];
  return c;
}
inline NodeMask operator~(const NodeMask& a) {
  NodeMask c;
  for (std::size_t z = 0; z < 8; ++z) c.z[z] = ~a.z[z];
  return c;
}

// Each node's neighbour before or after it along an axis, within the brick.
inline NodeMask before(const NodeMask& m, std::size_t axis) {
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z)
    out.z[z] = axis == 0   ? (m.z[z] & kNotX0) >> 1
               : axis == 1 ? m.z[z] >> 8
               : z < 7     ? m.z[z + 1]
                           : 0;
  return out;
}
inline NodeMask after(const NodeMask& m, std::size_t axis) {
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z)
    out.z[z] = axis == 0   ? (m.z[z] & kNotX7) << 1
               : axis == 1 ? m.z[z] << 8
               : z > 0     ? m.z[z - 1]
                           : 0;
  return out;
}

using Masks = std::vector<NodeMask>;  // (rows)

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
    const bool any = !coarse_.empty() || !queue_.empty();
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
    (band_.row[cell] < 0 ? coarse_ : queue_).push_back(std::uint32_t(cell));
  }

  // Whole bricks first: most others then get all their water at once.
  std::size_t next_cell() {
    std::vector<std::uint32_t>& from = coarse_.empty() ? queue_ : coarse_;
    const std::size_t cell = from.back();
    from.pop_back();
    return cell;
  }

  void run() {
    while (!coarse_.empty() || !queue_.empty()) {
      const std::size_t cell = next_cell();
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
          if (cell_[next]) continue;
          if (band_.row[cell] >= 0 && !through(wet, edges, axis, step).any()) continue;
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
  std::vector<std::uint32_t> coarse_, queue_;
  std::uint8_t tag_ = 0;
};

// The six neighbours of each node, rows only: walls are never farther away than that.
inline Masks neighbours(const Grid& grid, const NarrowBand& band, const Masks& nodes) {
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

}  // namespace h6::io::bake::flooding
