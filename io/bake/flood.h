// SPDX-License-Identifier: Apache-2.0
// flood.h - flood fill over nodes, 64 at a time. Private to this folder.
//
// The flood moves between passable nodes along edges that no triangle crosses. Bricks without a row
// are passable everywhere and are filled as a whole. The result is a set, so it does not depend on
// the order of work or the number of threads.
#pragma once
#include <algorithm>

#include "io/bake/grid.h"

namespace h6::io::bake::flooding {

inline constexpr std::uint64_t kNotX0 = 0xfefefefefefefefe, kNotX7 = 0x7f7f7f7f7f7f7f7f;
inline constexpr std::uint64_t kX0 = 0x0101010101010101, kX7 = 0x8080808080808080;
inline constexpr std::uint64_t kY0 = 0xff, kY7 = std::uint64_t{0xff} << 56;

inline const Crossing kOpenEdges{};

// The neighbour's nodes that `nodes` reach through the common face, along edges that are not cut.
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

// Layers of bricks make slabs. One thread at a time floods a slab; drops that leave it wait for the
// next round.
//
// An open cell is a brick without a row, or a row whose nodes and edges are all passable: it fills
// as a whole. The open cells connected with the border are found first, as bits, 64 at a time. The
// rows next to them draw water from them, and only the rest passes water from brick to brick.
class Flood {
 public:
  enum class Edges { cut, open };
  enum class Over { cells, rows };  // cells: through bricks without a row too
  // `free` must outlive the flood.
  Flood(const Grid& grid, const NarrowBand& band, const Masks& free, Edges edges, unsigned threads,
        Over over = Over::cells);

  // Floods from the border of the grid. Needs Over::cells.
  void from_border();

  // Floods from further nodes. Returns false if none of them is passable and dry. Bricks without a
  // row that this call reaches get the tag.
  bool from_nodes(const Masks& seeds, std::uint8_t tag);
  bool from_nodes(const std::vector<RowNodes>& seeds, std::uint8_t tag);

  const Masks& wet() const { return wet_; }
  Masks take_wet() { return std::move(wet_); }
  std::vector<std::uint8_t>& cells() { return cell_; }

 private:
  struct Drop {
    std::uint32_t cell;
    std::uint64_t bits;  // nodes of the layer next to the slab that the drop left
  };
  struct Slab {
    int first = 0, end = 0;  // layers
    std::size_t first_row = 0, end_row = 0;
    std::vector<std::uint32_t> whole, queue;  // open cells; other cells
    std::vector<Drop> down, up;
    std::vector<RowNodes> given;  // nodes that rows drew from their neighbours
    bool any = false;             // a seed was dry and passable
    bool busy() const { return !whole.empty() || !queue.empty(); }
  };
  // Bits of a cell's state. Full: it can take no more water. Dirty: new water has not spread in it.
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
  std::size_t words_;  // for a line of cells
  std::uint8_t tag_ = 0;
};

// The six neighbours of the nodes, as far as they lie in rows: walls are never farther away.
Masks neighbours(const Grid& grid, const NarrowBand& band, const Masks& nodes, unsigned threads);

}  // namespace h6::io::bake::flooding
