// SPDX-License-Identifier: Apache-2.0
// flood.cpp - the flood of flood.h.
#include "io/bake/flood.h"

#include <algorithm>

#include "sched/parallel_for.h"

namespace h6::io::bake::flooding {
namespace {

constexpr int kSlabs = 16;

bool same(const NodeMask& a, const NodeMask& b) {
  std::uint64_t differ = 0;
  for (std::size_t z = 0; z < 8; ++z) differ |= a.z[z] ^ b.z[z];
  return differ == 0;
}

// Whether the brick is at the border of the grid, and which of its nodes are.
bool on_border(const Grid& grid, const std::array<int, 3>& at) {
  for (std::size_t k = 0; k < 3; ++k)
    if (at[k] == 0 || at[k] + 1 == grid.bricks[k]) return true;
  return false;
}
NodeMask border_nodes(const Grid& grid, const std::array<int, 3>& at) {
  NodeMask m;
  for (std::size_t z = 0; z < 8; ++z) {
    if (at[0] == 0) m.z[z] |= kX0;
    if (at[0] + 1 == grid.bricks[0]) m.z[z] |= kX7;
    if (at[1] == 0) m.z[z] |= kY0;
    if (at[1] + 1 == grid.bricks[1]) m.z[z] |= kY7;
  }
  if (at[2] == 0) m.z[0] = ~std::uint64_t{0};
  if (at[2] + 1 == grid.bricks[2]) m.z[7] = ~std::uint64_t{0};
  return m;
}

// Floods lines of nodes that are `by` bits apart, up and down. `one`, `two`, `four`: from which
// nodes one, two and four steps up are free.
std::uint64_t flow(std::uint64_t wet, std::uint64_t one, std::uint64_t two, std::uint64_t four,
                   int by) {
  wet |= (wet & one) << by;
  wet |= (wet & two) << 2 * by;
  wet |= (wet & four) << 4 * by;
  wet |= wet >> by & one;
  wet |= wet >> 2 * by & two;
  wet |= wet >> 4 * by & four;
  return wet;
}

// The bits of `open` that are connected with those of `wet` along the word.
std::uint64_t along(std::uint64_t wet, std::uint64_t open) {
  std::uint64_t up = open, down = open;
  for (int by = 1; by < 64; by *= 2) {
    wet |= (wet << by & up) | (wet >> by & down);
    up &= up << by;
    down &= down >> by;
  }
  return wet;
}

}  // namespace

Flood::Flood(const Grid& grid, const NarrowBand& band, const Masks& free, Edges edges,
             unsigned threads, Over over)
    : grid_(grid),
      band_(band),
      free_(free),
      edges_(edges),
      over_(over),
      threads_(threads),
      wet_(band.rows()),
      state_(grid.cells()),
      cell_(grid.cells(), 0),
      words_((std::size_t(grid.bricks[0]) + 63) / 64) {
  const int layers = grid.bricks[2];
  thick_ = (layers + kSlabs - 1) / kSlabs;
  for (int first = 0; first < layers; first += thick_) {
    Slab slab;
    slab.first = first;
    slab.end = std::min(layers, first + thick_);
    const auto row_of = [&](int layer) {
      const std::size_t cell = grid.cell(0, 0, layer);
      return std::size_t(std::lower_bound(band.cell.begin(), band.cell.end(), cell) -
                         band.cell.begin());
    };
    slab.first_row = row_of(slab.first);
    slab.end_row = row_of(slab.end);
    slabs_.push_back(std::move(slab));
  }
  each_slab([&](Slab& slab) {
    const std::size_t layer = grid.cell(0, 0, 1);
    std::fill(state_.begin() + std::ptrdiff_t(std::size_t(slab.first) * layer),
              state_.begin() + std::ptrdiff_t(std::size_t(slab.end) * layer),
              over == Over::cells ? kOpen : kFull);
    for (std::size_t r = slab.first_row; r < slab.end_row; ++r) {
      wet_[r] = NodeMask{};
      state_[band.cell[r]] = is_open(r) ? kOpen : free[r].any() ? 0 : kFull;
    }
  });
}

bool Flood::is_open(std::size_t r) const {
  if (!same(free_[r], kAllNodes)) return false;
  const Crossing& c = crossing(r);
  std::uint64_t cut = 0;
  for (const NodeMask& edge : c.edge)
    for (std::uint64_t z : edge.z) cut |= z;
  return cut == 0;
}

template <class F>
void Flood::each_slab(F&& f) {
  sched::parallel_for(slabs_.size(), threads_, [&](std::size_t s) { f(slabs_[s]); });
}

// The nodes of a row that draw water from the six neighbours. source(cell): the wet nodes there, or
// null. `uncut`: no triangle crosses an edge of a source.
template <class F>
NodeMask Flood::drawn(std::size_t r, bool uncut, F&& source) const {
  const std::size_t cell = band_.cell[r];
  const std::array<int, 3> at = grid_.place(cell);
  const std::size_t stride[3] = {1, std::size_t(grid_.bricks[0]), grid_.cell(0, 0, 1)};
  NodeMask in;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (at[axis] + 1 < grid_.bricks[axis])
      if (const NodeMask* wet = source(cell + stride[axis]))
        in = in | through(*wet, crossing(r), axis, -1);
    if (at[axis] > 0)
      if (const NodeMask* wet = source(cell - stride[axis])) {
        const std::int32_t below = uncut ? -1 : band_.row[cell - stride[axis]];
        in = in | through(*wet, below < 0 ? kOpenEdges : crossing(std::size_t(below)), axis, 1);
      }
  }
  return in;
}

// All open cells connected with one on the border; a line of cells along x is a few words.
std::vector<std::uint64_t> Flood::open_from_border() const {
  const std::size_t nx = std::size_t(grid_.bricks[0]), ny = std::size_t(grid_.bricks[1]),
                    nz = std::size_t(grid_.bricks[2]), lines = ny * nz, layer = ny * words_;
  std::vector<std::uint64_t> open(lines * words_, 0), wet(lines * words_, 0);
  for (std::size_t line = 0; line < lines; ++line) {
    std::uint64_t* to = &open[line * words_];
    for (std::size_t a = 0; a < nx; ++a)
      to[a / 64] |= std::uint64_t((state_[line * nx + a] & kOpen) != 0) << (a % 64);
    const std::size_t b = line % ny, c = line / ny;
    if (b == 0 || b + 1 == ny || c == 0 || c + 1 == nz)
      std::copy_n(to, words_, &wet[line * words_]);
    wet[line * words_] |= to[0] & 1;
    wet[line * words_ + (nx - 1) / 64] |= to[(nx - 1) / 64] & std::uint64_t{1} << ((nx - 1) % 64);
  }
  bool changed;
  const auto visit = [&](std::size_t line) {
    const std::size_t b = line % ny, c = line / ny, first = line * words_;
    for (std::size_t k = 0; k < 2 * words_; ++k) {  // there and back
      const std::size_t in = k < words_ ? k : 2 * words_ - 1 - k, i = first + in;
      std::uint64_t w = wet[i];
      if (w == open[i]) continue;
      if (b > 0) w |= wet[i - words_];
      if (b + 1 < ny) w |= wet[i + words_];
      if (c > 0) w |= wet[i - layer];
      if (c + 1 < nz) w |= wet[i + layer];
      if (in > 0) w |= wet[i - 1] >> 63;
      if (in + 1 < words_) w |= wet[i + 1] << 63;
      w = along(w & open[i], open[i]);
      changed |= w != wet[i];
      wet[i] = w;
    }
  };
  do {
    changed = false;
    for (std::size_t line = 0; line < lines; ++line) visit(line);
    for (std::size_t line = lines; line-- > 0;) visit(line);
  } while (changed);
  return wet;
}

void Flood::from_border() {
  tag_ = 1;
  const std::vector<std::uint64_t> open = open_from_border();
  const std::size_t nx = std::size_t(grid_.bricks[0]);
  const auto reached = [&](std::size_t cell) {
    const std::size_t line = std::uint32_t(cell) / std::uint32_t(nx), a = cell - line * nx;
    return (open[line * words_ + a / 64] >> (a % 64) & 1) != 0;
  };
  each_slab([&](Slab& slab) {
    const std::size_t end = grid_.cell(0, 0, slab.end);
    for (std::size_t cell = grid_.cell(0, 0, slab.first); cell < end; ++cell)
      if (reached(cell)) fill_cell(cell);
    for (std::size_t r = slab.first_row; r < slab.end_row; ++r) {
      const std::size_t cell = band_.cell[r];
      if (state_[cell] & (kOpen | kFull)) continue;
      NodeMask in =
          drawn(r, true, [&](std::size_t next) { return reached(next) ? &kAllNodes : nullptr; });
      const std::array<int, 3> at = grid_.place(cell);
      if (on_border(grid_, at)) in = in | border_nodes(grid_, at);
      if (!take(r, in)) continue;
      spread(r);
      state_[cell] |= kQueued;
      slab.queue.push_back(std::uint32_t(cell));
    }
  });
  run();
}

bool Flood::from_nodes(const Masks& seeds, std::uint8_t tag) {
  tag_ = tag;
  each_slab([&](Slab& slab) {
    slab.any = false;
    for (std::size_t r = slab.first_row; r < slab.end_row; ++r) {
      const std::size_t cell = band_.cell[r];
      if ((state_[cell] & kFull) || !seeds[r].any()) continue;
      if (over_ == Over::cells) {
        offer(slab, cell, seeds[r]);
        slab.any |= slab.busy();
      } else if (state_[cell] & kOpen) {
        fill_cell(cell);
        slab.any = true;
      } else if (take(r, seeds[r])) {
        spread(r);
        slab.any = true;
      }
    }
  });
  if (std::none_of(slabs_.begin(), slabs_.end(), [](const Slab& s) { return s.any; })) return false;
  // With Over::rows nearly all rows are seeds and already full, so it is cheaper if the others
  // draw.
  if (over_ == Over::rows) {
    each_slab([&](Slab& slab) {
      for (std::size_t r = slab.first_row; r < slab.end_row; ++r) {
        if (state_[band_.cell[r]] & kFull) continue;
        const NodeMask in = drawn(r, false, [&](std::size_t next) {
          return band_.row[next] < 0 ? nullptr : &wet_[std::size_t(band_.row[next])];
        });
        if (in.any()) slab.given.push_back({std::uint32_t(r), in});
      }
    });
    each_slab([&](Slab& slab) {
      for (const RowNodes& given : slab.given) offer(slab, band_.cell[given.row], given.nodes);
      slab.given.clear();
    });
  }
  run();
  return true;
}

bool Flood::from_nodes(const std::vector<RowNodes>& seeds, std::uint8_t tag) {
  tag_ = tag;
  bool any = false;
  for (const RowNodes& seed : seeds) {
    const std::size_t cell = band_.cell[seed.row];
    Slab& slab = slabs_[std::size_t(grid_.place(cell)[2] / thick_)];
    offer(slab, cell, seed.nodes);
    any |= slab.busy();
  }
  run();
  return any;
}

void Flood::run() {
  while (std::any_of(slabs_.begin(), slabs_.end(), [](const Slab& s) { return s.busy(); })) {
    each_slab([&](Slab& slab) { flood(slab); });
    for (std::size_t s = 0; s < slabs_.size(); ++s) {
      if (s > 0) absorb(slabs_[s], slabs_[s - 1].up, 0);
      if (s + 1 < slabs_.size()) absorb(slabs_[s], slabs_[s + 1].down, 7);
    }
    for (Slab& slab : slabs_) {
      slab.up.clear();
      slab.down.clear();
    }
  }
}

void Flood::absorb(Slab& slab, const std::vector<Drop>& drops, std::size_t layer) {
  for (const Drop& drop : drops) {
    NodeMask nodes;
    nodes.z[layer] = drop.bits;
    offer(slab, drop.cell, nodes);
  }
}

// Returns false if all these nodes are wet already or not passable.
bool Flood::take(std::size_t r, const NodeMask& nodes) {
  const NodeMask bits = nodes & free_[r] & ~wet_[r];
  if (!bits.any()) return false;
  wet_[r] = wet_[r] | bits;
  return true;
}

void Flood::fill_cell(std::size_t cell) {
  state_[cell] |= kFull;
  if (const std::int32_t r = band_.row[cell]; r >= 0)
    wet_[std::size_t(r)] = kAllNodes;
  else
    cell_[cell] = tag_;
}

void Flood::offer(Slab& slab, std::size_t cell, const NodeMask& nodes) {
  std::uint8_t& state = state_[cell];
  if (state & kFull) return;
  if (state & kOpen) {
    if (!nodes.any()) return;
    fill_cell(cell);
    slab.whole.push_back(std::uint32_t(cell));
  } else if (take(std::size_t(band_.row[cell]), nodes)) {
    if (!(state & kQueued)) slab.queue.push_back(std::uint32_t(cell));
    state |= kQueued | kDirty;
  }
}

void Flood::flood(Slab& slab) {
  // Open cells come first, so that most others get all their water at once. The others follow in
  // the order in which they were met, which is mostly that of memory.
  for (std::size_t next = 0; slab.busy();) {
    std::size_t cell;
    if (!slab.whole.empty()) {
      cell = slab.whole.back();
      slab.whole.pop_back();
    } else {
      cell = slab.queue[next++];
      if (next == slab.queue.size()) {
        slab.queue.clear();
        next = 0;
      }
      std::uint8_t& state = state_[cell];
      if (state & kDirty) spread(std::size_t(band_.row[cell]));
      state &= std::uint8_t(~(kQueued | kDirty));
    }
    spill(slab, cell);
  }
}

// Floods inside one brick until nothing changes, along x and y in steps of one, two and four nodes.
void Flood::spread(std::size_t r) {
  const Crossing& c = crossing(r);
  const auto& pass = free_[r].z;
  std::array<std::uint64_t, 8> x1, x2, x4, y1, y2, y4, up, wet = wet_[r].z, before;
  for (std::size_t z = 0; z < 8; ++z) {
    // Nodes from which one, two and four steps are free.
    x1[z] = pass[z] & pass[z] >> 1 & ~c.edge[0].z[z] & kNotX7;
    x2[z] = x1[z] & x1[z] >> 1;
    x4[z] = x2[z] & x2[z] >> 2;
    y1[z] = pass[z] & pass[z] >> 8 & ~c.edge[1].z[z];
    y2[z] = y1[z] & y1[z] >> 8;
    y4[z] = y2[z] & y2[z] >> 16;
  }
  for (std::size_t z = 0; z < 7; ++z) up[z] = pass[z] & pass[z + 1] & ~c.edge[2].z[z];
  do {
    before = wet;
    for (std::size_t z = 1; z < 8; ++z) wet[z] |= wet[z - 1] & up[z - 1];
    for (std::size_t z = 7; z-- > 0;) wet[z] |= wet[z + 1] & up[z];
    for (std::size_t z = 0; z < 8; ++z) {
      wet[z] = flow(flow(wet[z], x1[z], x2[z], x4[z], 1), y1[z], y2[z], y4[z], 8);
    }
  } while (wet != before);
  wet_[r].z = wet;
  if (wet == pass) state_[band_.cell[r]] |= kFull;
}

// Passes a cell's water on to its six neighbours.
void Flood::spill(Slab& slab, std::size_t cell) {
  const bool whole = (state_[cell] & kOpen) != 0;
  const NodeMask& wet = whole ? kAllNodes : wet_[std::size_t(band_.row[cell])];
  const Crossing& own = whole ? kOpenEdges : crossing(std::size_t(band_.row[cell]));
  const std::array<int, 3> at = grid_.place(cell);
  const std::ptrdiff_t stride[3] = {1, grid_.bricks[0], std::ptrdiff_t(grid_.cell(0, 0, 1))};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int step : {-1, 1}) {
      const int to = at[axis] + step;
      if (to < 0 || to >= grid_.bricks[axis]) continue;
      const std::size_t next = std::size_t(std::ptrdiff_t(cell) + step * stride[axis]);
      const bool leaves = axis == 2 && (to < slab.first || to >= slab.end);
      if (!leaves && (state_[next] & kFull)) continue;
      // The edge between two bricks belongs to the lower one.
      const std::int32_t r = band_.row[next];
      const Crossing& edges = step > 0 ? own : r >= 0 ? crossing(std::size_t(r)) : kOpenEdges;
      const NodeMask in = through(wet, edges, axis, step);
      if (!leaves) {
        offer(slab, next, in);
      } else if (const std::uint64_t bits = in.z[step > 0 ? 0 : 7]; bits != 0) {
        (step < 0 ? slab.down : slab.up).push_back({std::uint32_t(next), bits});
      }
    }
}

Masks neighbours(const Grid& grid, const NarrowBand& band, const Masks& nodes, unsigned threads) {
  Masks out(nodes.size());
  sched::parallel_for(nodes.size(), threads, [&](std::size_t r) {
    const auto& from = nodes[r].z;
    NodeMask here;
    auto& own = here.z;
    for (std::size_t z = 0; z < 8; ++z) {
      own[z] = (from[z] & kNotX7) << 1 | (from[z] & kNotX0) >> 1 | from[z] << 8 | from[z] >> 8;
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
        if (next >= 0) here = here | through(nodes[std::size_t(next)], kOpenEdges, axis, -step);
      }
    out[r] = here;
  });
  return out;
}

}  // namespace h6::io::bake::flooding
