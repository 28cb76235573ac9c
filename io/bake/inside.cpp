// SPDX-License-Identifier: Apache-2.0
// inside.cpp - from unsigned distances u and the reached set R to signed distances.
//
// Nodes of R get u - offset, which is exact. The others need their distance to R.
// - No part of R is nearer than offset - u (u is 1-Lipschitz and equals `offset` on the border of
// R).
// - A straight line from p to a point r of R that is shorter than u(p) + u(r) meets no surface: the
//   two empty balls overlap. If every such line is longer, p lies behind a sheet, and R begins at
//   u + offset or farther off: exactly there if the sheet nearest to p borders R.
// - Chains of nodes give an upper bound D >= distance to R: D(r) = offset - u(r) on R, and
//   D(p) = min over the 26 neighbours q of D(q) + |p - q|. They are at most 13 % too long.
// Hence, for p not in R:
//   D <  u + offset: R is in sight: max(offset - u, (D - slack)/1.13), which is offset - u along
//     smooth sheets and the depth of the dent below a crack.
//   D >= u + offset: p is behind a sheet: u + offset. Sheets buried in the solid (two parts
//   overlap)
//     do not border R, and u + offset is too short there:
//     max(u + offset, (D - corner slack)/1.13), a lower bound of the way to the nodes of R.
// An outside that holds no node of R, such as a groove between nodes, starts no chain. D then goes
// the long way round, and the depth is too large. Bricks without a buried sheet in or beside them
// hold no chains; there chains pass by u + offset, or else nodes at the edge of the other bricks
// come out up to 1.4 voxel too deep.
#include <algorithm>
#include <atomic>
#include <optional>

#include "io/bake/chains.h"
#include "io/bake/flood.h"
#include "io/bake/grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

// Whether a cell of the brick, or one that shares its nodes, has a point within the band. The
// result is only valid where R is near.
bool near_zero_set(const NarrowBand& band, const Around& around) {
  bool near = false;
  for (std::size_t i = 0; i < 27; ++i) {
    const std::int32_t row = around.row[i];
    near |= row >= 0 && (band.towards[std::size_t(row)] >> (26 - i) & 1);
  }
  return near;
}
bool near_outside(const Reached& reached, const Around& around) {
  for (std::size_t i = 0; i < 27; ++i)
    if (around.row[i] < 0 ? around.outside[i] : reached.node[std::size_t(around.row[i])].any())
      return true;
  return false;
}

using flooding::operator&, flooding::operator|, flooding::operator~;
constexpr NodeMask kNoNodes{};

std::size_t count(const NodeMask& nodes) {
  std::size_t n = 0;
  for (std::uint64_t z : nodes.z) n += std::size_t(std::popcount(z));
  return n;
}

// Nodes with one of `nodes` (rows) among the 27 around them, themselves included. Bricks without a
// row count as `outside` where they are in R, else as the opposite.
NodeMask beside_any(const Around& around, const Masks& nodes, bool outside = true) {
  std::array<const NodeMask*, 27> at;
  for (std::size_t i = 0; i < 27; ++i)
    at[i] = around.row[i] >= 0             ? &nodes[std::size_t(around.row[i])]
            : around.outside[i] == outside ? &kAllNodes
                                           : &kNoNodes;
  return spread(at);
}

// The same within the brick alone, which mostly decides.
NodeMask beside_here(const NodeMask& nodes) {
  std::uint64_t layer[10] = {};
  for (std::size_t z = 0; z < 8; ++z) {
    const std::uint64_t own = nodes.z[z],
                        along = own | (own & flooding::kNotX7) << 1 | (own & flooding::kNotX0) >> 1;
    layer[z + 1] = along | along << 8 | along >> 8;
  }
  NodeMask out;
  for (std::size_t z = 0; z < 8; ++z) out.z[z] = layer[z] | layer[z + 1] | layer[z + 2];
  return out;
}

bool any_outside(const NodeMask& nodes, const NodeMask& of) { return (nodes & ~of).any(); }

// Whether u is larger at a node's neighbour (13 + dx + 3*dy + 9*dz) than at the opposite one.
bool rises_towards(const Grid& grid, const NarrowBand& band, const Around& around, int node,
                   int neighbour) {
  const int by[3] = {neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1};
  const int x = node % 8, y = node / 8 % 8, z = node / 64;
  const auto u = [&](int i, int j, int k) {
    const std::int32_t row = around.row[Around::entry(i, j, k)];
    return row < 0 ? float(grid.reach())
                   : band.nodes(std::size_t(row))[((k & 7) * 8 + (j & 7)) * 8 + (i & 7)];
  };
  return u(x + by[0], y + by[1], z + by[2]) > u(x - by[0], y - by[1], z - by[2]);
}

// The steps of look_inside and the data they share.
class Look {
 public:
  Look(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
       const Steps& steps, Inside& inside)
      : grid_(grid),
        band_(band),
        reached_(reached),
        threads_(threads),
        steps_(steps),
        inside_(inside),
        offset_(float(grid.offset)),
        buried_(band.rows(), 0),
        live_(band.rows(), 0),
        corrected_(band.rows(), 0) {}

  bool run() {
    if (!steps_.tell("sign", 0.65)) return false;
    inside_.needed.resize(band_.rows());
    inside_.buried.resize(band_.rows());
    inside_.depths.resize(band_.rows());
    inspect_rows();
    if (!deep_.empty()) find_thin();
    Masks().swap(deep_);
    Masks().swap(thin_);
    find_corrected();
    inside_.in_sight = std::move(band_.free);  // only for its memory
    constexpr std::size_t kSlice = 4096;
    sched::parallel_for((band_.rows() + kSlice - 1) / kSlice, threads_, [&](std::size_t slice) {
      const std::size_t first = slice * kSlice, end = std::min(band_.rows(), first + kSlice);
      std::fill_n(inside_.in_sight.begin() + std::ptrdiff_t(first), end - first, NodeMask{});
    });
    if (!lay_chains()) return false;
    if (offset_ > 0 && !steps_.run("sign", 0.7, 0.8, band_.tiles.count(), threads_,
                                   [&](std::size_t tile) { look(tile); }))
      return false;
    inside_.chains = std::move(chains_);
    for (std::size_t r = 0; r < band_.rows(); ++r) inside_.buried[r] |= corrected_[r];
    inside_.corrected = std::move(corrected_);
    return true;
  }

 private:
  // The most nodes that a chain takes from R to a node on the near side of a sheet, and across the
  // sheet: one step gains a voxel in any direction.
  int hops_in_sight() const { return offset_ > 0 ? int(std::ceil(offset_ + 0.05f)) : 0; }
  int hops_across() const { return offset_ > 0 ? int(std::ceil(2 * offset_ + 0.2f)) : 0; }

  // Calls f(rows) for the tiles that have rows.
  template <class F>
  void each_tile(F&& f) {
    sched::parallel_for(band_.tiles.count(), threads_, [&](std::size_t tile) {
      if (band_.tiles.first[tile] != band_.tiles.first[tile + 1])
        f(TileRows(grid_, band_, reached_, tile));
    });
  }

  // Finds the rows that are needed, those with nodes inside, those with buried sheets, thin walls.
  void inspect_rows() {
    beside_.resize(offset_ > 0 ? band_.rows() : 0);
    if (!band_.crossing.empty()) find_deep();
    std::atomic<std::size_t> dry{0};
    each_tile([&](const TileRows& rows) {
      std::size_t dry_here = 0;
      rows.each([&](std::size_t place, std::size_t r) {
        const NodeMask& nodes = reached_.node[r];
        std::uint64_t some = 0, all = ~std::uint64_t{0};
        for (std::uint64_t w : nodes.z) {
          some |= w;
          all &= w;
        }
        const bool whole = all == ~std::uint64_t{0};
        // The row alone is mostly enough, and the rows around it are scattered over memory.
        const bool wanted = grid_.wants(band_.cell[r]);
        const bool near = band_.towards[r] >> 13 & 1;
        std::optional<Around> around;
        if (wanted && (some == 0 || !near)) around.emplace(rows, place);
        const bool outside = some != 0 || (wanted && near_outside(reached_, *around));
        inside_.needed[r] = wanted && outside && (near || near_zero_set(band_, *around));
        inside_.buried[r] = near && !outside && grid_.wanted == nullptr;
        if (!whole) dry_here += some == 0 ? kBrickSamples : kBrickSamples - count(nodes);
        live_[r] = inside_.needed[r] && !whole;
        if (!beside_.empty())
          beside_[r] = whole     ? kAllNodes
                       : outside ? beside_any(Around(rows, place), reached_.node)
                                 : kNoNodes;
        if (band_.crossing.empty()) return;
        find_buried(rows, place, r);
        thin_[r] = suspects(rows, place, r);
      });
      dry.fetch_add(dry_here, std::memory_order_relaxed);
    });
    inside_.inside_nodes = dry;
  }

  // A sheet is buried in the solid where the surface crosses an edge, or meets a node, with no node
  // of R around. (Next to nodes of R it may be a groove narrower than a voxel.)
  void find_buried(const TileRows& rows, std::size_t place, std::size_t r) {
    const Crossing& c = band_.crossing[r];
    NodeMask met;
    for (std::size_t z = 0; z < 8; ++z)
      met.z[z] = c.edge[0].z[z] | c.edge[1].z[z] | c.edge[2].z[z] | c.on.z[z];
    if (!met.any()) return;
    if (!beside_.empty())
      buried_[r] = any_outside(met, beside_[r]);
    else
      buried_[r] = any_outside(met, beside_here(reached_.node[r])) &&
                   any_outside(met, beside_any(Around(rows, place), reached_.node));
  }

  // The nodes inside that are deeper than any in a wall thinner than kThin.
  void find_deep() {
    thin_.resize(band_.rows());
    deep_.resize(band_.rows());
    const float least = float(kThin / 2) - offset_;
    sched::parallel_for((band_.rows() + 63) / 64, threads_, [&](std::size_t block) {
      for (std::size_t r = 64 * block; r < std::min(band_.rows(), 64 * (block + 1)); ++r) {
        const NodeMask inside = ~reached_.node[r];
        deep_[r] = inside;
        if (!inside.any() || !(band_.towards[r] >> 13 & 1)) continue;
        NodeMask far;
        kernels::nodes_above(band_.nodes(r), least, far.z.data());
        deep_[r] = inside & far;
      }
    });
  }

  // A wall may be thin where the surface crosses an edge between two nodes of R, and at a node
  // inside, if no deep node is around.
  NodeMask suspects(const TileRows& rows, std::size_t place, std::size_t r) const {
    constexpr std::size_t kNext[3] = {1, TileRows::kSide, TileRows::kSide * TileRows::kSide};
    const NodeMask& reached = reached_.node[r];
    NodeMask found = ~reached;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t next = place + kNext[axis];
      const NodeMask& there = rows.row[next] >= 0  ? reached_.node[std::size_t(rows.row[next])]
                              : rows.outside[next] ? kAllNodes
                                                   : kNoNodes;
      const NodeMask after = flooding::before(reached, axis) |
                             flooding::through(there, flooding::kOpenEdges, axis, -1);
      found = found | (reached & after & band_.crossing[r].edge[axis]);
    }
    found = found & ~beside_here(deep_[r]);
    return found.any() ? found & ~beside_any(Around(rows, place), deep_, false) : found;
  }

  // Sharp edges have such nodes too, but deep ones within two steps. In the wall, rays decide
  // (io/walls), as far as three nodes from the others: up to the solid that the wall stands on.
  void find_thin() {
    Masks wide(band_.rows());
    const auto any = [&] {
      return std::any_of(thin_.begin(), thin_.end(), [](const NodeMask& m) { return m.any(); });
    };
    if (!any()) return;
    each_tile([&](const TileRows& rows) {
      rows.each([&](std::size_t place, std::size_t r) {
        wide[r] = beside_any(Around(rows, place), deep_, false);
      });
    });
    each_tile([&](const TileRows& rows) {
      rows.each([&](std::size_t place, std::size_t r) {
        if (thin_[r].any()) thin_[r] = thin_[r] & ~beside_any(Around(rows, place), wide, false);
      });
    });
    if (!any()) return;
    for (int step = 0; step < 3; ++step) {
      each_tile([&](const TileRows& rows) {
        rows.each([&](std::size_t place, std::size_t r) {
          std::array<const NodeMask*, 27> at;
          const Around around(rows, place);
          for (std::size_t i = 0; i < 27; ++i)
            at[i] = around.row[i] >= 0 ? &thin_[std::size_t(around.row[i])] : &kNoNodes;
          wide[r] = spread(at);
        });
      });
      thin_.swap(wide);
    }
    inside_.thin = std::move(thin_);
  }

  // With an offset, a node is near a buried sheet if u <= offset and it is farther from R than the
  // far side of a sheet that borders R can be. Depths are corrected in such bricks and one brick
  // around.
  void find_corrected() {
    if (beside_.empty() && std::find(buried_.begin(), buried_.end(), 1) == buried_.end()) return;
    Masks wide, last;
    for (int hop = 1; hop + 1 < hops_across() && !beside_.empty(); ++hop) {
      last = hop == 1 ? beside_ : wide;
      wide.resize(band_.rows());
      each_tile([&](const TileRows& rows) {
        rows.each([&](std::size_t place, std::size_t r) {
          wide[r] = beside_any(Around(rows, place), last);
        });
      });
    }
    const Masks& before = wide.empty() ? beside_ : wide;
    const bool one_more = hops_across() > 1;
    each_tile([&](const TileRows& rows) {
      rows.each([&](std::size_t place, std::size_t r) {
        bool buried = buried_[r] != 0;
        if (!buried && live_[r] && !before.empty()) {
          NodeMask deep;
          for (std::size_t z = 0; z < 8; ++z) deep.z[z] = ~band_.free[r].z[z] & ~before[r].z[z];
          if (deep.any() && one_more) {
            const NodeMask near = beside_any(Around(rows, place), before);
            for (std::size_t z = 0; z < 8; ++z) deep.z[z] &= ~near.z[z];
          }
          buried = deep.any();
        }
        if (!buried) return;
        for (const std::int32_t next : Around(rows, place).row)
          if (next >= 0)
            std::atomic_ref(corrected_[std::size_t(next)]).store(1, std::memory_order_relaxed);
      });
    });
  }

  bool lay_chains() {
    std::vector<std::uint8_t> deep(band_.rows());
    bool any = false;
    for (std::size_t r = 0; r < deep.size(); ++r) {
      deep[r] = live_[r] && (corrected_[r] || hops_in_sight() > 1);
      any |= deep[r];
    }
    if (!any) return true;
    chains_ = std::make_shared<Chains>(grid_, band_, reached_, deep, threads_, &corrected_);
    // A chain along diagonals has fewer steps than a shorter one along the axes. So chains that
    // stop after some passes are too long: places in a field baked to a tolerance were wrong by up
    // to 1.6 tolerances.
    for (int pass = 1; chains_->pass(); ++pass)
      if (!steps_.tell("sign", 0.7 - 0.05 / pass)) return false;
    return true;
  }

  // A row that has nodes whose side is still unknown.
  struct Asked {
    std::size_t place, row;
    bool held;
    NodeMask todo;
    kernels::ChainSides sides;
  };

  // Finds the side of the sheet that nodes are on, where u alone does not decide. Chains that are
  // held decide by themselves; otherwise, and where a sheet is close, the nodes around the brick
  // are needed.
  void look(std::size_t tile) {
    if (band_.tiles.first[tile] == band_.tiles.first[tile + 1]) return;
    thread_local const auto room = std::make_unique<ChainRoom>();
    thread_local std::array<Asked, 64> asked;
    thread_local std::vector<ChainRoom::Wanted> bricks;
    const TileRows rows(grid_, band_, reached_, tile);
    bricks.clear();
    std::size_t count = 0;
    rows.each([&](std::size_t place, std::size_t r) {
      if (!live_[r]) return;
      Asked& row = asked[count];
      row.place = place;
      row.row = r;
      row.held = chains_ && chains_->holds(r);
      for (std::size_t z = 0; z < 8; ++z)
        row.todo.z[z] = ~reached_.node[r].z[z] & (row.held ? ~std::uint64_t{0} : beside_[r].z[z]);
      if (!row.todo.any()) return;
      NodeMask unsure = row.todo;
      if (row.held) {
        kernels::chain_sides(chains_->nodes(r), band_.nodes(r), limits(), row.sides);
        for (std::size_t z = 0; z < 8; ++z) unsure.z[z] &= row.sides.close[z];
      }
      if (unsure.any()) bricks.push_back({place, neighbours_of(unsure)});
      ++count;
    });
    room->fill(grid_, band_, reached_, chains_.get(), rows, bricks, nullptr);
    for (std::size_t i = 0; i < count; ++i) look(rows, *room, asked[i]);
  }
  kernels::ChainLimits limits() const {
    return {offset_, kSlack, kCrooked, 0.5f * (kSlack + (kCrooked - 1) * offset_)};
  }
  void look(const TileRows& rows, ChainRoom& room, Asked& row) {
    const std::size_t r = row.row;
    const Chain* first = room.first(row.place);
    Chain stepped[kBrickSamples];
    if (!row.held) {
      kernels::chain_step(first, ChainRoom::kLine, ChainRoom::kLayer, stepped, 8, 64);
      kernels::chain_sides(stepped, band_.nodes(r), limits(), row.sides);
    }
    NodeMask& in_sight = inside_.in_sight[r];
    for (std::size_t z = 0; z < 8; ++z) {
      in_sight.z[z] |= row.todo.z[z] & row.sides.in_sight[z];
      for (std::uint64_t bits = row.held ? 0 : row.todo.z[z] & row.sides.dented[z]; bits != 0;
           bits &= bits - 1) {
        const std::size_t n = 64 * z + std::size_t(std::countr_zero(bits));
        const float dent = (float(stepped[n]) * kChainUnit - kSlack) / kCrooked;
        inside_.depths[r].push_back({std::uint32_t(n), dent});
      }
    }
    // Chains cannot decide the side this close to a sheet. The nearest way to R goes through a
    // neighbour q. On R's side u grows along that way, so q is farther from the sheet than the node
    // opposite to q.
    NodeMask close;
    for (std::size_t z = 0; z < 8; ++z) close.z[z] = row.todo.z[z] & row.sides.close[z];
    if (!close.any()) return;
    std::uint8_t nearest[kBrickSamples];
    kernels::chain_nearest(first, ChainRoom::kLine, ChainRoom::kLayer, close.z.data(), nearest);
    const Around around(rows, row.place);
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t bits = close.z[z]; bits != 0; bits &= bits - 1) {
        const int n = int(64 * z) + std::countr_zero(bits);
        if (rises_towards(grid_, band_, around, n, nearest[n])) in_sight.set(std::size_t(n));
      }
  }

  const Grid& grid_;
  NarrowBand& band_;
  const Reached& reached_;
  unsigned threads_;
  const Steps& steps_;
  Inside& inside_;
  float offset_;
  std::vector<std::uint8_t> buried_, live_, corrected_;  // (rows)
  Masks beside_;                                         // (rows) one step from R
  Masks deep_, thin_;                                    // (rows) far inside; near thin walls
  std::shared_ptr<Chains> chains_;
};

}  // namespace

bool look_inside(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
                 const Steps& steps, Inside& inside) {
  return Look(grid, band, reached, threads, steps, inside).run();
}

}  // namespace h6::io::bake
