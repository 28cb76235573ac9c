// bake_flood.cpp - the flood of bake_flood.h.
#include "io/bake_flood.h"

#include <algorithm>

#include "sched/parallel_for.h"

namespace h6::io::bake::flooding {
namespace {

constexpr int kSlabs = 16;

bool all(const NodeMask& m) {
  std::uint64_t z = ~std::uint64_t{0};
  for (std::uint64_t w : m.z) z &= w;
  return z == ~std::uint64_t{0};
}

void pour(std::uint64_t& into, std::uint64_t bits, bool& changed) {
  changed |= (bits & ~into) != 0;
  into |= bits;
}

// The six faces of a brick.
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

}  // namespace

Flood::Flood(const Grid& grid, const NarrowBand& band, const Masks& free, Edges edges,
             unsigned threads)
    : grid_(grid),
      band_(band),
      free_(free),
      edges_(edges),
      threads_(threads),
      wet_(band.rows()),
      new_(band.rows()),
      queued_(grid.cells(), 0),
      cell_(grid.cells(), 0) {
  const int layers = grid.bricks[2], thick = (layers + kSlabs - 1) / kSlabs;
  for (int first = 0; first < layers; first += thick) {
    Slab slab;
    slab.first = first;
    slab.end = std::min(layers, first + thick);
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
    for (std::size_t r = slab.first_row; r < slab.end_row; ++r) wet_[r] = new_[r] = NodeMask{};
  });
}

template <class F>
void Flood::each_slab(F&& f) {
  sched::parallel_for(slabs_.size(), threads_, [&](std::size_t s) { f(slabs_[s]); });
}

void Flood::from_border() {
  tag_ = 1;
  each_slab([&](Slab& slab) {
    for (int c = slab.first; c < slab.end; ++c)
      for (int b = 0; b < grid_.bricks[1]; ++b)
        for (int a = 0; a < grid_.bricks[0]; ++a) {
          if (!on_border(grid_, {a, b, c})) {
            a = grid_.bricks[0] - 2;  // on to the end of the line
            continue;
          }
          const std::size_t cell = grid_.cell(a, b, c);
          if (band_.row[cell] < 0)
            offer_all(slab, cell);
          else
            offer(slab, cell, border_nodes(grid_, {a, b, c}));
        }
  });
  run();
}

bool Flood::from_nodes(const Masks& seeds, std::uint8_t tag) {
  tag_ = tag;
  each_slab([&](Slab& slab) {
    for (std::size_t r = slab.first_row; r < slab.end_row; ++r) {
      if (seeds[r].any()) offer(slab, band_.cell[r], seeds[r]);
    }
  });
  const bool any =
      std::any_of(slabs_.begin(), slabs_.end(), [](const Slab& s) { return s.busy(); });
  run();
  return any;
}

void Flood::run() {
  while (std::any_of(slabs_.begin(), slabs_.end(), [](const Slab& s) { return s.busy(); })) {
    each_slab([&](Slab& slab) { flood(slab); });
    sched::parallel_for(slabs_.size(), threads_, [&](std::size_t s) {
      if (s > 0) absorb(slabs_[s], slabs_[s - 1].up, 0);
      if (s + 1 < slabs_.size()) absorb(slabs_[s], slabs_[s + 1].down, 7);
    });
    for (Slab& slab : slabs_) {
      slab.up.clear();
      slab.down.clear();
    }
  }
}

void Flood::absorb(Slab& slab, const std::vector<Drop>& drops, std::size_t layer) {
  for (const Drop& drop : drops) {
    if (band_.row[drop.cell] < 0) {
      offer_all(slab, drop.cell);
    } else {
      NodeMask nodes;
      nodes.z[layer] = drop.bits;
      offer(slab, drop.cell, nodes);
    }
  }
}

// A brick without a row gets its water at once.
void Flood::offer_all(Slab& slab, std::size_t cell) {
  if (cell_[cell]) return;
  cell_[cell] = tag_;
  push(slab, cell);
}

void Flood::offer(Slab& slab, std::size_t cell, const NodeMask& nodes) {
  const std::size_t r = std::size_t(band_.row[cell]);
  const NodeMask bits = nodes & free_[r] & ~wet_[r];
  if (!bits.any()) return;
  new_[r] = new_[r] | bits;
  push(slab, cell);
}

void Flood::flood(Slab& slab) {
  while (slab.busy()) {
    // Whole bricks first: most others then get all their water at once.
    std::vector<std::uint32_t>& from = slab.coarse.empty() ? slab.queue : slab.coarse;
    const std::size_t cell = from.back();
    from.pop_back();
    queued_[cell] = 0;
    const std::int32_t r = band_.row[cell];
    if (r >= 0) {
      spread(std::size_t(r));
      spill(slab, cell, wet_[std::size_t(r)], crossing(std::size_t(r)), false);
    } else {
      NodeMask full;
      full.z.fill(~std::uint64_t{0});
      spill(slab, cell, full, kOpen, true);
    }
  }
}

// Inside one brick, until nothing changes.
void Flood::spread(std::size_t r) {
  const Crossing& c = crossing(r);
  const auto& pass = free_[r].z;
  auto& wet = wet_[r].z;
  if (&c == &kOpen && all(free_[r])) {
    wet = free_[r].z;
    new_[r] = {};
    return;
  }
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

// Into the six neighbours. `whole`: the brick has no row, its neighbours are met all along.
void Flood::spill(Slab& slab, std::size_t cell, const NodeMask& wet, const Crossing& own,
                  bool whole) {
  const std::array<int, 3> at = grid_.place(cell);
  const std::ptrdiff_t stride[3] = {1, grid_.bricks[0],
                                    std::ptrdiff_t(grid_.bricks[0]) * grid_.bricks[1]};
  // The neighbours lie anywhere in memory: all are asked for before the first is needed.
  std::int32_t rows[6];
  for (std::size_t i = 0; i < 6; ++i) {
    const int to = at[i / 2] + (i % 2 ? 1 : -1);
    rows[i] = to < 0 || to >= grid_.bricks[i / 2]
                  ? -1
                  : band_.row[std::size_t(std::ptrdiff_t(cell) + (to - at[i / 2]) * stride[i / 2])];
  }
  for (const std::int32_t r : rows)
    if (r >= 0) {
      __builtin_prefetch(&free_[std::size_t(r)]);
      __builtin_prefetch(&wet_[std::size_t(r)]);
    }
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int step : {-1, 1}) {
      const int to = at[axis] + step;
      if (to < 0 || to >= grid_.bricks[axis]) continue;
      const std::size_t next = std::size_t(std::ptrdiff_t(cell) + step * stride[axis]);
      const std::int32_t r = rows[2 * axis + (step > 0)];
      const bool leaves = axis == 2 && (to < slab.first || to >= slab.end);
      if (r < 0 && !leaves && cell_[next]) continue;
      if (whole && r < 0) {
        if (leaves)
          (step < 0 ? slab.down : slab.up).push_back({std::uint32_t(next), ~std::uint64_t{0}});
        else
          offer_all(slab, next);
        continue;
      }
      // The edge between two bricks belongs to the lower one.
      const Crossing& edges = step > 0 ? own : r >= 0 ? crossing(std::size_t(r)) : kOpen;
      const NodeMask in = through(wet, edges, axis, step);
      if (leaves) {
        const std::uint64_t bits = in.z[step > 0 ? 0 : 7];
        if (bits != 0) (step < 0 ? slab.down : slab.up).push_back({std::uint32_t(next), bits});
      } else if (r < 0) {
        if (in.any()) offer_all(slab, next);
      } else {
        offer(slab, next, in);
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
        if (next >= 0) here = here | through(nodes[std::size_t(next)], kOpen, axis, -step);
      }
    out[r] = here;
  });
  return out;
}

}  // namespace h6::io::bake::flooding
