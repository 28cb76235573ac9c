// bake_inside.cpp - from unsigned distances u and the reached set R to signed distances.
//
// Nodes of R get u - offset: exact. For the others the distance to R is wanted.
// - No part of R is nearer than offset - u (u is 1-Lipschitz and is `offset` on the border of R).
// - A straight line from p to a point r of R that is shorter than u(p) + u(r) meets no surface: the
//   two empty balls overlap. So if every such line is longer, p lies behind a sheet, and R begins
//   at u + offset: exactly there if the sheet that p is nearest to borders R.
// - Chains of nodes give an upper bound D >= distance to R: D(r) = offset - u(r) on R, and
//   D(p) = min over the 26 neighbours of D(q) + |p - q|. They are at most 13 % too long.
// Hence, for p not in R:
//   D <  u + offset: R is in sight: max(offset - u, (D - slack)/1.13), which is offset - u along
//     smooth sheets and the depth of the dent below a crack.
//   D >= u + offset: behind a sheet: u + offset. Sheets buried in the solid (two parts run into
//     each other) do not border R, and u + offset is too short there:
//     max(u + offset, (D - corner slack)/1.13), a lower bound.
#include <algorithm>
#include <atomic>

#include "io/bake_grid.h"
#include "io/bake_chains.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr int kDeepPasses = 6;       // how far buried sheets are corrected [nodes]

// A brick is kept when a cell of its own, or one that shares its nodes, has a point within band of
// the zero set. Only where R is near.
void find_needed(const Grid& grid, const NarrowBand& band, const Reached& reached,
                 unsigned threads, std::vector<std::uint8_t>& needed) {
  needed.assign(band.rows(), 0);
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    const Around around(grid, band, reached, r);
    bool near_surface = false, near_outside = false;
    for (std::size_t i = 0; i < 27; ++i) {
      const std::int32_t row = around.row[i];
      near_surface |= row >= 0 && (band.towards[std::size_t(row)] >> (26 - i) & 1);
      near_outside |= row >= 0 ? reached.node[std::size_t(row)].any() : around.outside[i];
    }
    needed[r] = near_surface && near_outside;
  });
}

// Whether the 27 nodes around a node of the brick are all reached, or none of them is.
class Company {
 public:
  Company(const Around& around, const Reached& reached) : around_(around), reached_(reached) {}
  bool all(std::size_t n, bool wet) const {
    const int p[3] = {int(n % 8), int(n / 8 % 8), int(n / 64)};
    for (int i = 0; i < 27; ++i)
      if (is_wet(p[0] + i % 3 - 1, p[1] + i / 3 % 3 - 1, p[2] + i / 9 - 1) != wet) return false;
    return true;
  }

 private:
  bool is_wet(int x, int y, int z) const {
    const int i = 13 + (x + 8) / 8 - 1 + 3 * ((y + 8) / 8 - 1) + 9 * ((z + 8) / 8 - 1);
    const std::int32_t row = around_.row[std::size_t(i)];
    if (row < 0) return around_.outside[std::size_t(i)];
    return reached_.node[std::size_t(row)].get(
        std::size_t(((z & 7) * 8 + (y & 7)) * 8 + (x & 7)));
  }
  const Around& around_;
  const Reached& reached_;
};

// Whether the surface crosses an edge, or meets a node, with nothing reached around: a sheet buried
// in the solid. (Next to reached nodes it may be a groove narrower than a voxel.)
bool has_buried_sheet(const Crossing& c, const Company& company) {
  for (std::size_t z = 0; z < 8; ++z) {
    std::uint64_t cut = c.edge[0].z[z] | c.edge[1].z[z] | c.edge[2].z[z] | c.on.z[z];
    for (; cut != 0; cut &= cut - 1)
      if (company.all(64 * z + std::size_t(std::countr_zero(cut)), false)) return true;
  }
  return false;
}

// Crossed edges between reached nodes without a node inside anywhere around: a wall thinner than
// the spacing. A sharp rim has nodes inside close by and does not count.
std::size_t count_thin(const Crossing& c, const Company& company) {
  std::size_t thin = 0;
  for (const NodeMask& edge : c.edge)
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t cut = edge.z[z]; cut != 0; cut &= cut - 1)
        thin += company.all(64 * z + std::size_t(std::countr_zero(cut)), true);
  return thin;
}

// Nodes with a reached node among the 27 around them, themselves included.
NodeMask beside_reached(const Around& around, const Reached& reached) {
  return spread(around, [&](std::size_t i) -> NodeMask {
    if (around.row[i] >= 0) return reached.node[std::size_t(around.row[i])];
    return around.outside[i] ? kAllNodes : NodeMask{};
  });
}

// A node so close to a sheet that chains cannot tell the side: the nearest way to R goes through q;
// R's side is where u grows, so q is farther from the sheet than its mirror image.
bool faces_outside(const Grid& grid, const NarrowBand& band, const Around& around,
                   const kernels::ChainBrick& d,
                   int x, int y, int z) {
  int nearest = kChainFar, at[3] = {0, 0, 0};
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int apart = (dx != 0) + (dy != 0) + (dz != 0);
        const int way = d.v[z + 1 + dz][y + 1 + dy][x + 1 + dx] + kernels::kChainStep[apart];
        if (apart == 0 || way >= nearest) continue;
        nearest = way;
        at[0] = dx, at[1] = dy, at[2] = dz;
      }
  const auto u = [&](int i, int j, int k) {
    const std::int32_t row = around.row[Around::entry(i, j, k)];
    return row < 0 ? float(grid.reach())
                   : band.nodes(std::size_t(row))[((k & 7) * 8 + (j & 7)) * 8 + (i & 7)];
  };
  return u(x + at[0], y + at[1], z + at[2]) > u(x - at[0], y - at[1], z - at[2]);
}

// The steps of look_inside, with what they share.
class Look {
 public:
  Look(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
       const Steps& steps, Inside& inside)
      : grid_(grid), band_(band), reached_(reached), threads_(threads), steps_(steps),
        inside_(inside), offset_(float(grid.offset)), buried_(band.rows(), 0),
        live_(band.rows(), 0), corrected_(band.rows(), 0) {}

  bool run() {
    find_needed(grid_, band_, reached_, threads_, inside_.needed);
    if (!steps_.tell("sign", 0.65)) return false;
    inspect_rows();
    find_corrected();
    Masks().swap(band_.free);  // not needed any more, and it is large
    inside_.in_sight.assign(band_.rows(), NodeMask{});
    inside_.depths.resize(band_.rows());
    if (!lay_chains()) return false;
    const std::vector<std::vector<std::uint32_t>> tiles = rows_by_tile(grid_, band_, live_);
    if (!steps_.run("sign", 0.7, 0.8, tiles.size(), threads_, [&](std::size_t tile) {
          for (const std::uint32_t r : tiles[tile]) look(r);
        }))
      return false;
    inside_.chains = std::move(chains_);
    inside_.corrected = std::move(corrected_);
    return true;
  }

 private:
  // How many nodes a chain takes from R to a node on the near side of a sheet, at most: one step
  // can gain a voxel in any direction.
  int hops_in_sight() const { return offset_ > 0 ? int(std::ceil(offset_ + 0.05f)) : 0; }
  int hops_across() const { return offset_ > 0 ? int(std::ceil(2 * offset_ + 0.2f)) : 0; }

  // Which rows have nodes inside, sheets buried there, thin walls.
  void inspect_rows() {
    beside_.resize(offset_ > 0 ? band_.rows() : 0);
    std::atomic<std::size_t> thin{0}, dry{0};
    sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
      std::size_t wet = 0;
      for (std::uint64_t w : reached_.node[r].z) wet += std::size_t(std::popcount(w));
      dry.fetch_add(kBrickSamples - wet, std::memory_order_relaxed);
      live_[r] = inside_.needed[r] && wet < kBrickSamples;
      if (beside_.empty() && band_.crossing.empty()) return;
      const Around around(grid_, band_, reached_, r);
      if (!beside_.empty()) beside_[r] = beside_reached(around, reached_);
      if (band_.crossing.empty()) return;
      const Company company(around, reached_);
      buried_[r] = has_buried_sheet(band_.crossing[r], company);
      if (offset_ == 0)
        thin.fetch_add(count_thin(band_.crossing[r], company), std::memory_order_relaxed);
    });
    inside_.thin_edges = thin;
    inside_.inside_nodes = dry;
  }

  // With an offset, what lies within it of a sheet and farther from R than the far side of a sheet
  // that borders R is buried. Depths are corrected there and one brick around.
  void find_corrected() {
    Masks wide = beside_, last;
    for (int hop = 1; hop < hops_across() && !wide.empty(); ++hop) {
      last = wide;
      sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
        const Around around(grid_, band_, reached_, r);
        wide[r] = spread(around, [&](std::size_t i) -> NodeMask {
          if (around.row[i] >= 0) return last[std::size_t(around.row[i])];
          return around.outside[i] ? kAllNodes : NodeMask{};
        });
      });
    }
    if (!wide.empty())
      sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
        if (!live_[r]) return;
        std::uint64_t deep = 0;
        for (std::size_t z = 0; z < 8; ++z) deep |= ~band_.free[r].z[z] & ~wide[r].z[z];
        buried_[r] |= deep != 0;
      });
    sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
      const Around around(grid_, band_, reached_, r);
      for (std::int32_t next : around.row)
        corrected_[r] |= next >= 0 && buried_[std::size_t(next)];
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
    chains_ = std::make_shared<Chains>(grid_, band_, reached_, deep, threads_);
    const int steps = std::max(kDeepPasses + int(offset_), hops_across());
    const int passes = (steps + kStepsAPass - 1) / kStepsAPass;
    for (int pass = 0; pass < passes; ++pass) {
      chains_->pass();
      if (!steps_.tell("sign", 0.65 + 0.05 * pass / passes)) return false;
    }
    return true;
  }

  // Which side of its sheet a node is on, where u alone does not tell.
  void look(std::size_t r) {
    if (offset_ == 0) return;
    const bool held = chains_ && chains_->holds(r);
    NodeMask todo;
    for (std::size_t z = 0; z < 8; ++z)
      todo.z[z] = ~reached_.node[r].z[z] & (held ? ~std::uint64_t{0} : beside_[r].z[z]);
    if (!todo.any()) return;
    const Around around(grid_, band_, reached_, r);
    kernels::ChainBrick d;
    bool gathered = false;
    const auto gather = [&] {
      if (!gathered) gather_chains(grid_, band_, reached_, chains_.get(), around, d);
      gathered = true;
    };
    Chain stepped[kBrickSamples];
    const Chain* chain = stepped;
    if (held) {
      chain = chains_->nodes(r);
    } else {
      gather();
      kernels::chain_step(d, stepped);
    }
    const float* u = band_.nodes(r);
    const float close = 0.5f * (kSlack + (kCrooked - 1) * offset_);
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t bits = todo.z[z]; bits != 0; bits &= bits - 1) {
        const std::size_t n = 64 * z + std::size_t(std::countr_zero(bits));
        if (chain[n] >= kChainFar) continue;
        const float there = float(chain[n]) * kChainUnit;
        if (there < u[n] + offset_) {
          inside_.in_sight[r].set(n);
          const float dent = (there - kSlack) / kCrooked;
          if (!held && dent > std::max(offset_ - u[n], 0.0f))
            inside_.depths[r].push_back({std::uint32_t(n), dent});
        } else if (u[n] <= close) {
          gather();
          if (faces_outside(grid_, band_, around, d, int(n % 8), int(n / 8 % 8), int(z)))
            inside_.in_sight[r].set(n);
        }
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
  std::shared_ptr<Chains> chains_;
};

}  // namespace

bool look_inside(const Grid& grid, NarrowBand& band, const Reached& reached,
                 unsigned threads, const Steps& steps, Inside& inside) {
  return Look(grid, band, reached, threads, steps, inside).run();
}

}  // namespace h6::io::bake
