// SPDX-License-Identifier: Apache-2.0
// flood.h - what water reaches over nodes, 64 at a time. Private to bake_*.cpp.
//
// A node is passable when its mask says so; it is left through edges that no triangle crosses.
// Bricks without a row are all passable, so the flood takes them whole. The result is a set: the
// order of work and the number of threads do not show in it.
#pragma once
#include <algorithm>

#include "io/bake/grid.h"

namespace h6::io::bake::flooding {

inline constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
inline constexpr std::uint64_t kX0 = 0x0101010101010101, kX7 = 0x8080808080808080;
inline constexpr std::uint64_t kY0 = 0xff, kY7 = std::uint64_t{0xff} << 56;

inline const Crossing kOpenEdges{};

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

// Layers of bricks make slabs. A slab is flooded by one thread at a time; what runs over into the
// slabs above and below waits there as drops for the next round.
//
// A row whose nodes are all passable, by every edge, is like a brick without a row: it takes all
// its water at once. These are open cells. Those that hang together with the border are found as
// bits, 64 cells at a time, and the rows between them draw from them; only what is left is handed
// on from brick to brick.
class Flood {
 public:
  enum class Edges { cut, open };
  enum class Over { cells, rows };  // whether bricks without a row are passable
  // `free` must outlive the flood.
  Flood(const Grid& grid, const NarrowBand& band, const Masks& free, Edges edges, unsigned threads,
        Over over = Over::cells);

  // From all around: the border of the grid is outside, and connected. Over cells.
  void from_border();

  // From more nodes, as far as they are passable and dry; false: none is. Bricks without a row that
  // are reached now get the tag.
  bool from_nodes(const Masks& seeds, std::uint8_t tag);
  bool from_nodes(const std::vector<RowNodes>& seeds, std::uint8_t tag);

  const Masks& wet() const { return wet_; }
  Masks take_wet() { return std::move(wet_); }
  std::vector<std::uint8_t>& cells() { return cell_; }

 private:
  struct Drop {
    std::uint32_t cell;
    std::uint64_t bits;  // nodes of the layer next to the slab it comes from
  };
  struct Slab {
    int first = 0, end = 0;  // layers
    std::size_t first_row = 0, end_row = 0;
    std::vector<std::uint32_t> whole, queue;  // cells that are open, and others
    std::vector<Drop> down, up;
    std::vector<RowNodes> given;  // what rows found with their neighbours
    bool any = false;             // of the seeds, a node was dry and passable
    bool busy() const { return !whole.empty() || !queue.empty(); }
  };
  // What is known of a cell: bits. Full: it has all the water it can have. Dirty: water came that
  // has not spread in it.
  static constexpr std::uint8_t kQueued = 1, kOpen = 2, kFull = 4, kDirty = 8;

  const Crossing& crossing(std::size_t r) const {
    return edges_ == Edges::open || band_.crossing.empty() ? kOpenEdges : band_.crossing[r];
  }
  bool is_open(std::size_t r) const;
  std::vector<std::uint64_t> open_from_border() const;
  template <class F>
  NodeMask drawn(std::size_t r, bool uncut, F&& source) const;
  void run();
  void flood(Slab& slab);
  void absorb(Slab& slab, const std::vector<Drop>& drops, std::size_t layer);
  void spread(std::size_t r);
  void spill(Slab& slab, std::size_t cell);
  void offer(Slab& slab, std::size_t cell, const NodeMask& nodes);
  bool take(std::size_t r, const NodeMask& nodes);
  void fill_cell(std::size_t cell);
  template <class F>
  void each_slab(F&& f);

  const Grid& grid_;
  const NarrowBand& band_;
  const Masks& free_;
  Edges edges_;
  Over over_;
  unsigned threads_;
  Masks wet_;
  std::vector<std::uint8_t> state_, cell_;  // (cells)
  std::vector<Slab> slabs_;
  int thick_ = 1;      // layers of a slab
  std::size_t words_;  // of a line of cells
  std::uint8_t tag_ = 0;
};

// The six neighbours of each node, rows only: walls are never farther away than that.
Masks neighbours(const Grid& grid, const NarrowBand& band, const Masks& nodes, unsigned threads);

}  // namespace h6::io::bake::flooding
