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
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr float kFarAway = 1e9f;
// Chains start at a node, not on the border of R [voxel]: by this much they are too long at most,
// where R is flat; and where it is a crease or a corner, sqrt(3) - 1.
constexpr float kSlack = 0.15f, kCornerSlack = 0.74f;
constexpr float kCrooked = 1.13f;    // longest chain over straight line
constexpr int kDeepPasses = 6;       // how far buried sheets are corrected [nodes]
constexpr float kHalfCell = 0.8661f; // farthest a point can be from the nearest node

// A brick and its 26 neighbours: entry 13 + dx + 3*dy + 9*dz.
struct Around {
  std::array<std::int32_t, 27> row;    // -1: no row
  std::array<bool, 27> outside;        // where there is no row: all reached
};

Around look_around(const Grid& grid, const NarrowBand& band, const Reached& reached,
                   std::size_t r) {
  Around around;
  const std::array<int, 3> at = grid.place(band.cell[r]);
  for (int i = 0; i < 27; ++i) {
    const int to[3] = {at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1};
    around.row[std::size_t(i)] = -1;
    around.outside[std::size_t(i)] = true;  // beyond the grid
    bool in = true;
    for (std::size_t k = 0; k < 3; ++k) in &= to[k] >= 0 && to[k] < grid.bricks[k];
    if (!in) continue;
    const std::size_t cell = grid.cell(to[0], to[1], to[2]);
    around.row[std::size_t(i)] = band.row[cell];
    around.outside[std::size_t(i)] = reached.cell[cell] != 0;
  }
  return around;
}

// The 8^3 values of a brick and one layer around it; node (x,y,z) at [z+1][y+1][x+1].
struct Padded {
  float v[10][10][10];
  float& at(int x, int y, int z) { return v[z + 1][y + 1][x + 1]; }
};

template <class Missing>
void gather(const Around& around, const float* values, Missing&& missing, Padded& out) {
  for (int z = -1; z <= 8; ++z)
    for (int y = -1; y <= 8; ++y) {
      const int bz = (z + 8) / 8 - 1, by = (y + 8) / 8 - 1;
      const std::size_t line = std::size_t((z & 7) * 64 + (y & 7) * 8);
      for (int bx = -1; bx <= 1; ++bx) {
        const std::size_t i = std::size_t(13 + bx + 3 * by + 9 * bz);
        const int x0 = bx < 0 ? -1 : bx * 8, x1 = bx < 0 ? 0 : bx > 0 ? 9 : 8;
        const std::int32_t row = around.row[i];
        if (row < 0) {
          std::fill(&out.v[z + 1][y + 1][x0 + 1], &out.v[z + 1][y + 1][0] + x1 + 1, missing(i));
        } else {
          const float* from = values + std::size_t(row) * kBrickSamples + line;
          for (int x = x0; x < x1; ++x) out.at(x, y, z) = from[x & 7];
        }
      }
    }
}

constexpr float kStep[4] = {0.0f, 1.0f, 1.41421356f, 1.73205081f};

// One pass of D over a brick.
void relax(const Padded& p, float* d) {
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y) {
      float line[8];
      for (int x = 0; x < 8; ++x) line[x] = p.v[z + 1][y + 1][x + 1];
      for (int dz = 0; dz < 3; ++dz)
        for (int dy = 0; dy < 3; ++dy) {
          const float* q = p.v[z + dz][y + dy];
          const int apart = (dz != 1) + (dy != 1);
          const float straight = kStep[apart], aside = kStep[apart + 1];
          for (int x = 0; x < 8; ++x)
            line[x] = std::min(line[x], std::min(q[x + 1] + straight,
                                                 std::min(q[x], q[x + 2]) + aside));
        }
      float* out = d + (z * 8 + y) * 8;
      for (int x = 0; x < 8; ++x) out[x] = line[x];
    }
}

// D, brick by brick; bricks of one parity are never neighbours, so a pass over the eight parities
// gives the same result on any number of threads.
class Chains {
 public:
  Chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
         const std::vector<Around>& around, unsigned threads)
      : grid_(grid), band_(band), around_(around), threads_(threads),
        d_(new float[band.rows() * kBrickSamples]) {
    for (std::size_t r = 0; r < band.rows(); ++r) {
      const std::array<int, 3> at = grid.place(band.cell[r]);
      rows_[std::size_t((at[0] & 1) + 2 * (at[1] & 1) + 4 * (at[2] & 1))].push_back(
          std::uint32_t(r));
    }
    const float offset = float(grid.offset);
    sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
      const float* u = band.nodes(r);
      for (std::size_t n = 0; n < kBrickSamples; ++n)
        d_[r * kBrickSamples + n] = reached.node[r].get(n) ? offset - u[n] : kFarAway;
    });
  }

  // `live`: rows to work on.
  void pass(const std::vector<std::uint8_t>& live) {
    for (const std::vector<std::uint32_t>& rows : rows_)
      sched::parallel_for(rows.size(), threads_, [&](std::size_t i) {
        if (!live[rows[i]]) return;
        Padded p;
        gather_d(rows[i], p);
        relax(p, d_.get() + std::size_t(rows[i]) * kBrickSamples);
      });
  }
  void gather_d(std::size_t r, Padded& p) const {
    const float clear = float(grid_.offset - grid_.reach());
    gather(around_[r], d_.get(),
           [&](std::size_t i) { return around_[r].outside[i] ? clear : kFarAway; }, p);
  }
  const float* nodes(std::size_t r) const { return d_.get() + r * kBrickSamples; }

 private:
  const Grid& grid_;
  const NarrowBand& band_;
  const std::vector<Around>& around_;
  unsigned threads_;
  std::unique_ptr<float[]> d_;
  std::array<std::vector<std::uint32_t>, 8> rows_;
};

// Nodes of a layer that faces a neighbour at (dx,dy,dz).
bool any_towards(const NodeMask& nodes, int dx, int dy, int dz) {
  std::uint64_t line = ~std::uint64_t{0};
  if (dx != 0) line &= dx < 0 ? 0x0101010101010101 : 0x8080808080808080;
  if (dy != 0) line &= dy < 0 ? std::uint64_t{0xff} : std::uint64_t{0xff} << 56;
  std::uint64_t found = 0;
  for (int z = dz > 0 ? 7 : 0; z <= (dz < 0 ? 0 : 7); ++z) found |= nodes.z[std::size_t(z)] & line;
  return found != 0;
}

// A brick is kept when a cell of its own, or one that shares its nodes, has a point within band of
// the zero set: such a cell has a corner with u < offset + band + half a cell. Only where R is
// near.
void find_needed(const Grid& grid, const NarrowBand& band, const Reached& reached,
                 const std::vector<Around>& around, unsigned threads,
                 std::vector<std::uint8_t>& needed) {
  std::vector<std::uint32_t> towards(band.rows());
  const float near = float(grid.offset + grid.band) + kHalfCell + 1e-3f;
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    NodeMask nodes;
    const float* u = band.nodes(r);
    for (std::size_t n = 0; n < kBrickSamples; ++n)
      nodes.z[n / 64] |= std::uint64_t(u[n] < near) << (n % 64);
    std::uint32_t bits = 0;
    for (int i = 0; i < 27; ++i)
      bits |= std::uint32_t(any_towards(nodes, i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)) << i;
    towards[r] = bits;
  });
  needed.assign(band.rows(), 0);
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    bool near_surface = false, near_outside = false;
    for (std::size_t i = 0; i < 27; ++i) {
      const std::int32_t row = around[r].row[i];
      near_surface |= row >= 0 && (towards[std::size_t(row)] >> (26 - i) & 1);
      near_outside |= row >= 0 ? reached.node[std::size_t(row)].any() : around[r].outside[i];
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

struct Depth {
  float offset;
  bool corrected;  // sheets are buried near here

  float behind(float u, float d) const {
    const float sheet = u + offset;
    return corrected && d < kFarAway ? std::max(sheet, (d - kCornerSlack) / kCrooked) : sheet;
  }
  float in_sight(float u, float d) const {
    return std::max(std::max(offset - u, 0.0f), (d - kSlack) / kCrooked);
  }
};

// A node so close to a sheet that chains cannot tell the side: the nearest way to R goes through r;
// R's side is where u grows, so r is farther from the sheet than its mirror image.
bool faces_outside(const Padded& u, const Padded& d, int x, int y, int z) {
  float nearest = kFarAway, gain = 0;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int apart = (dx != 0) + (dy != 0) + (dz != 0);
        const float way = d.v[z + 1 + dz][y + 1 + dy][x + 1 + dx] + kStep[apart];
        if (apart == 0 || way >= nearest) continue;
        nearest = way;
        gain = u.v[z + 1 + dz][y + 1 + dy][x + 1 + dx] - u.v[z + 1 - dz][y + 1 - dy][x + 1 - dx];
      }
  return gain > 0;
}

// The steps of sign_rows, with what they share.
class Signs {
 public:
  Signs(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
        const Steps& steps, Inside& inside)
      : grid_(grid), band_(band), reached_(reached), threads_(threads), steps_(steps),
        inside_(inside), offset_(float(grid.offset)), around_(band.rows()),
        buried_(band.rows(), 0), live_(band.rows(), 0), corrected_(band.rows(), 0) {}

  bool run() {
    sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
      around_[r] = look_around(grid_, band_, reached_, r);
    });
    find_needed(grid_, band_, reached_, around_, threads_, inside_.needed);
    if (!steps_.tell("sign", 0.65)) return false;
    inspect_rows();
    const bool any_buried = std::find(buried_.begin(), buried_.end(), 1) != buried_.end();
    if (offset_ > 0 || any_buried) {
      chains_ = std::make_unique<Chains>(grid_, band_, reached_, around_, threads_);
      if (!lay_chains()) return false;
    }
    if (offset_ > 0) find_unsure();
    return steps_.run("sign", 0.8, 0.85, band_.rows(), threads_,
                      [&](std::size_t r) { sign_row(r); });
  }

 private:
  // Which rows have nodes inside, sheets buried there, thin walls.
  void inspect_rows() {
    std::atomic<std::size_t> thin{0}, dry{0};
    sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
      std::size_t wet = 0;
      for (std::uint64_t w : reached_.node[r].z) wet += std::size_t(std::popcount(w));
      dry += kBrickSamples - wet;
      live_[r] = inside_.needed[r] && wet < kBrickSamples;
      if (band_.crossing.empty()) return;
      const Company company(around_[r], reached_);
      buried_[r] = has_buried_sheet(band_.crossing[r], company);
      if (offset_ == 0) thin += count_thin(band_.crossing[r], company);
    });
    inside_.thin_edges = thin;
    inside_.inside_nodes = dry;
  }

  // With an offset, first as far as the inner side of a sheet that borders R: what lies within the
  // offset of a sheet and has no chain then is buried. More passes only around buried sheets.
  bool lay_chains() {
    int passes = 0;
    const int across = offset_ > 0 ? int(std::ceil(2 * offset_ + 0.2f)) : 0;
    for (; passes < across; ++passes) {
      chains_->pass(live_);
      if (!steps_.tell("sign", 0.65 + 0.1 * passes / across)) return false;
    }
    if (offset_ > 0) {
      sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
        if (!live_[r]) return;
        const float *u = band_.nodes(r), *d = chains_->nodes(r);
        for (std::size_t n = 0; n < kBrickSamples; ++n)
          buried_[r] |= u[n] <= offset_ && d[n] >= kFarAway && !reached_.node[r].get(n);
      });
    }
    for (std::size_t r = 0; r < band_.rows(); ++r)
      for (std::int32_t next : around_[r].row)
        corrected_[r] |= next >= 0 && buried_[std::size_t(next)];
    std::vector<std::uint8_t> deep(band_.rows());
    for (std::size_t r = 0; r < deep.size(); ++r) deep[r] = live_[r] && corrected_[r];
    for (; passes < kDeepPasses + int(offset_); ++passes) {
      chains_->pass(deep);
      if (!steps_.tell("sign", 0.78)) return false;
    }
    return true;
  }

  // Nodes next to a sheet, in sight of R although chains are too crooked to show it.
  void find_unsure() {
    const float close = 0.5f * (kSlack + (kCrooked - 1) * offset_);
    in_sight_.resize(band_.rows());
    sched::parallel_for(band_.rows(), threads_, [&](std::size_t r) {
      if (!live_[r]) return;
      const float *u = band_.nodes(r), *d = chains_->nodes(r);
      Padded pu, pd;
      bool have = false;
      for (std::size_t n = 0; n < kBrickSamples; ++n) {
        if (u[n] > close || d[n] < u[n] + offset_ || d[n] >= kFarAway) continue;
        if (!have) {
          gather(around_[r], band_.u.get(), [&](std::size_t) { return float(grid_.reach()); }, pu);
          chains_->gather_d(r, pd);
          have = true;
        }
        if (faces_outside(pu, pd, int(n % 8), int(n / 8 % 8), int(n / 64))) in_sight_[r].set(n);
      }
    });
  }

  void sign_row(std::size_t r) {
    float* u = band_.u.get() + r * kBrickSamples;
    const float* d = chains_ ? chains_->nodes(r) : nullptr;
    const Depth depth{offset_, corrected_[r] != 0};
    const bool exact = offset_ == 0 && corrected_[r] == 0;
    for (std::size_t n = 0; n < kBrickSamples; ++n) {
      if (reached_.node[r].get(n))
        u[n] -= offset_;
      else if (exact)
        u[n] = band_.crossing[r].on.get(n) ? 0.0f : -u[n];
      else if (offset_ > 0 && in_sight_[r].get(n))
        u[n] -= offset_;
      else if (offset_ > 0 && d[n] < u[n] + offset_)
        u[n] = -depth.in_sight(u[n], d[n]);
      else
        u[n] = -depth.behind(u[n], d[n]);
    }
  }

  const Grid& grid_;
  NarrowBand& band_;
  const Reached& reached_;
  unsigned threads_;
  const Steps& steps_;
  Inside& inside_;
  float offset_;
  std::vector<Around> around_;
  std::vector<std::uint8_t> buried_, live_, corrected_;  // (rows)
  std::unique_ptr<Chains> chains_;
  std::vector<NodeMask> in_sight_;                       // (rows)
};

}  // namespace

bool sign_rows(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
               const Steps& steps, Inside& inside) {
  return Signs(grid, band, reached, threads, steps, inside).run();
}

}  // namespace h6::io::bake
