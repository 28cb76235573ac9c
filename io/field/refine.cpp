// SPDX-License-Identifier: Apache-2.0
// refine.cpp - which cells of a coarse field need finer samples, and those samples.
//
// Lengths are metres. A fine node is named by its numbers in the fine grid; every fourth is a
// coarse node too.
#include "io/field/refine.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>

#include "io/field/box.h"
#include "io/field/conform.h"
#include "kernels/field/missed_halves.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// Errors are measured at fine nodes and are larger between them, and faces towards coarser cells
// take the error of these: with 0.6 the worst place of a plate of 0.2 mm was 0.94 tolerances off.
constexpr double kMeasured = 0.3;
// The same at nodes of the middle field, which are fewer.
constexpr double kSuspected = 0.15;
// Farther beyond its band, a node of the fine bake may hold a bound in place of a distance.
constexpr double kExactBeyondBand = 1.9;  // [fine voxel]
// A place in the band has a node within half a fine cell's diagonal, which may lie beyond the band.
constexpr double kTestedBeyondBand = 0.867;  // [fine voxel]

// The nodes of the fine bake.
class FineNodes {
 public:
  FineNodes(const FieldData& fine, const std::vector<std::uint8_t>& inside)
      : fine_(fine),
        inside_(inside),
        exact_below_(float(fine.band + kExactBeyondBand * fine.voxel_size)),
        tested_(float(fine.band + kTestedBeyondBand * fine.voxel_size)) {}

  const FieldData& field() const { return fine_; }
  // Prefetches the samples of a brick.
  void ask_for(const GridNode& at) const {
    const std::int32_t row = row_of(fine_, at);
    if (row < 0) return;
    const float* const samples = &fine_.samples[std::size_t(row) * 512];
    for (int n = 0; n < 512; n += 16) __builtin_prefetch(samples + n);
  }
  bool exact(float sample) const { return std::fabs(sample) < exact_below_; }
  float tested() const { return tested_; }
  // Only exact nodes are tested.
  bool tested(float sample) const { return std::fabs(sample) < tested_; }

  // The values at the coarse nodes in fine brick `at`, 2 x 2 x 2, from whichever bake is exact
  // there. `coarse`: the first of the coarse bake's, in its brick, or null. `out`: likewise.
  void at_coarse_nodes(const GridNode& at, const float* coarse, float* out) const {
    const std::int32_t row = row_of(fine_, at);
    const float* const fine = row < 0 ? nullptr : &fine_.samples[std::size_t(row) * 512];
    const unsigned inside = inside_[place_in(at, fine_.bricks)];
    for (int k = 0; k < 8; ++k) {
      const int x = k & 1, y = k >> 1 & 1, z = k >> 2, to = (z * 8 + y) * 8 + x;
      const float* const known = coarse == nullptr ? nullptr : coarse + to;
      if (fine == nullptr) {
        out[to] = at_coarse_node(inside >> k & 1, known);
        continue;
      }
      const float value = fine[4 * to];
      out[to] = known == nullptr || exact(value) ? value : at_coarse_node(value < 0, known);
    }
  }

  // Whether a coarse cell reaches into the fine band and has a corner in this coarse brick. Such a
  // cell lies in the brick, or one cell below it along some axes.
  bool reach(const GridNode& brick) const {
    for (int b = 124; b >= 0; --b) {
      const int x = b % 5 - 1, y = b / 5 % 5 - 1, z = b / 25 - 1;
      const std::int32_t row =
          row_of(fine_, {kCut * brick[0] + x, kCut * brick[1] + y, kCut * brick[2] + z});
      if (row < 0) continue;
      if (x >= 0 && y >= 0 && z >= 0) return true;
      const float* const samples = &fine_.samples[std::size_t(row) * 512];
      float least = exact_below_;
      for (int k = z < 0 ? kCut : 0; k < 8; ++k)
        for (int j = y < 0 ? kCut : 0; j < 8; ++j)
          for (int i = x < 0 ? kCut : 0; i < 8; ++i)
            least = std::min(least, std::fabs(samples[64 * k + 8 * j + i]));
      if (tested(least)) return true;
    }
    return false;
  }
  // The side of the first node of a brick; past the last brick is outside.
  bool inside(const GridNode& brick) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (brick[k] >= fine_.bricks[k]) return false;
    const std::int32_t row = row_of(fine_, brick);
    return row < 0 ? inside_[place_in(brick, fine_.bricks)] & 1
                   : fine_.samples[std::size_t(row) * 512] < 0;
  }

 private:
  // Gives the value where the fine bake knows no more than the side.
  float at_coarse_node(bool inside, const float* coarse) const {
    if (coarse == nullptr) return inside ? -exact_below_ : exact_below_;
    if ((*coarse < 0) == inside) return *coarse;
    // The fine bake saw a gap open, or closed, where the coarse one did not.
    return -*coarse - 2 * float(fine_.offset);
  }

  const FieldData& fine_;
  const std::vector<std::uint8_t>& inside_;
  float exact_below_, tested_;  // [m]
};

// The coarse bricks: those of the coarse bake, and those near a surface that only the fine bake has
// (a groove that it keeps open, say).
void take_bricks(const FieldData& coarse, const FieldData& fine, const FineNodes& nodes,
                 unsigned threads, FieldData& out) {
  const std::size_t cells = coarse.brick_index.size();
  out.brick_index.assign(cells, -1);
  sched::parallel_for(cells, threads, [&](std::size_t c) {
    if (coarse.brick_index[c] >= 0 || nodes.reach(place_of(c, coarse.bricks)))
      out.brick_index[c] = 0;
  });
  std::int32_t rows = 0;
  for (std::int32_t& row : out.brick_index)
    if (row == 0) row = rows++;
  out.samples.resize(std::size_t(rows) * 512);
  out.triangle.assign(std::size_t(rows), -1);
  if (!fine.part.empty()) out.part.resize(std::size_t(rows));
  sched::parallel_for(cells, threads, [&](std::size_t c) {
    if (out.brick_index[c] < 0) return;
    const std::size_t row = std::size_t(out.brick_index[c]);
    const std::int32_t from = coarse.brick_index[c];
    const float* samples = from < 0 ? nullptr : &coarse.samples[std::size_t(from) * 512];
    const GridNode at = place_of(c, coarse.bricks);
    for (int box = 0; box < 64; ++box) {
      const int x = box % 4, y = box / 4 % 4, z = box / 16, first = 2 * ((z * 8 + y) * 8 + x);
      nodes.at_coarse_nodes({kCut * at[0] + x, kCut * at[1] + y, kCut * at[2] + z},
                            samples == nullptr ? nullptr : samples + first,
                            &out.samples[row * 512 + std::size_t(first)]);
    }
  });
}

// Each brick is named after the coarse bake, or after one of the fine bricks in it.
void take_names(const FieldData& coarse, const FieldData& fine, FieldData& out) {
  for (std::size_t c = 0; c < out.brick_index.size(); ++c) {
    if (out.brick_index[c] < 0) continue;
    const std::size_t row = std::size_t(out.brick_index[c]);
    const auto take = [&](const FieldData& field, std::int32_t from) {
      out.triangle[row] = field.triangle[std::size_t(from)];
      if (!field.part.empty()) out.part[row] = field.part[std::size_t(from)];
    };
    if (coarse.brick_index[c] >= 0) take(coarse, coarse.brick_index[c]);
    const GridNode at = place_of(c, out.bricks);
    for (int b = 0; b < 64 && out.triangle[row] < 0; ++b) {
      const std::int32_t f = fine.brick_index[place_in(
          {kCut * at[0] + b % 4, kCut * at[1] + b / 4 % 4, kCut * at[2] + b / 16}, fine.bricks)];
      if (f >= 0) take(fine, f);
    }
  }
}

// The finer samples of one brick.
struct Finer {
  std::array<std::int32_t, 512> index{};  // as in FieldData, for these halves and quarters
  std::vector<float> halves, quarters;
  std::size_t bytes() const {
    return sizeof *this + sizeof(float) * (halves.size() + quarters.size());
  }
};

// Decides for the cells of one coarse brick, box by box. A box is 2 x 2 x 2 cells: one fine brick.
class Chooser {
 public:
  Chooser(const FieldData& out, const FineNodes& nodes, double tolerance)
      : out_(out), nodes_(nodes), allowed_(float(kMeasured * tolerance)) {}

  // Returns null where the coarse samples are good enough.
  std::unique_ptr<Finer> choose(const GridNode& brick) const {
    std::unique_ptr<Finer> finer;
    // Grown here and copied at the end, the samples of a brick take no more than their room.
    thread_local std::vector<float> halves, quarters;
    halves.clear(), quarters.clear();
    float coarse[kBox], exact[kernels::kMissedBoxRoom] = {}, flat[kBox];
    read_box(out_, brick, coarse);
    for (int box = 0; box < 64; ++box) {
      const int x = box % 4, y = box / 4 % 4, z = box / 16;
      const GridNode at{kCut * brick[0] + x, kCut * brick[1] + y, kCut * brick[2] + z};
      nodes_.ask_for({at[0] + 2, at[1], at[2]});
      if (!read_box(nodes_.field(), at, exact)) continue;
      float corner[27];
      for (int n = 0; n < 27; ++n)
        corner[n] = coarse[81 * (2 * z + n / 9) + 9 * (2 * y + n / 3 % 3) + 2 * x + n % 3];
      unsigned missing = kernels::missed_halves(corner, 2, exact, allowed_, nodes_.tested());
      if (missing == 0) continue;
      missing &= whole_cells(corner);
      interpolate<3, 4>(corner, flat);
      for (int i = 0; i < 8; ++i) {
        if ((missing >> i & 1) == 0) continue;
        if (!finer) finer = std::make_unique<Finer>();
        const int cell[3] = {i & 1, i >> 1 & 1, i >> 2};
        finer
            ->index[std::size_t(64 * (2 * z + cell[2]) + 8 * (2 * y + cell[1]) + 2 * x + cell[0])] =
            cut(exact, flat, 4 * (81 * cell[2] + 9 * cell[1] + cell[0]), halves, quarters);
      }
    }
    if (finer) finer->halves = halves, finer->quarters = quarters;
    return finer;
  }

 private:
  // An unknown value misses nothing.
  bool misses(float exact, float found) const {
    return (std::fabs(exact - found) > allowed_) & nodes_.tested(exact);
  }

  // Bit i: all corners of cell i are known. Else it lies outside the band.
  static unsigned whole_cells(const float (&corner)[27]) {
    unsigned cells = 0;
    for (int i = 0; i < 8; ++i) {
      bool known = true;
      for (int k = 0; k < 8; ++k) {
        const int x = (i & 1) + (k & 1), y = (i >> 1 & 1) + (k >> 1 & 1), z = (i >> 2) + (k >> 2);
        known = known && !std::isnan(corner[9 * z + 3 * y + x]);
      }
      cells |= unsigned(known) << i;
    }
    return cells;
  }

  // Adds the finer samples of a cell, whose first node in the box is `first`. Returns their index.
  std::int32_t cut(const float* exact, const float (&flat)[kBox], int first,
                   std::vector<float>& halves, std::vector<float>& quarters) const {
    float quarter[125], half[27], found[125];
    float* to = quarter;
    for (int z = 0; z < 5; ++z)
      for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 5; ++x) {
          // A node that the fine bake does not know lies beyond the band, or in a brick whose
          // coarse samples are good enough.
          const int at = first + 81 * z + 9 * y + x;
          *to++ = nodes_.exact(exact[at]) ? exact[at] : flat[at];
        }
    to = half;
    for (int z = 0; z < 5; z += 2)
      for (int y = 0; y < 5; y += 2)
        for (int x = 0; x < 5; x += 2) *to++ = quarter[25 * z + 5 * y + x];
    interpolate<3, 2>(half, found);
    int wrong = 0;
    for (int n = 0; n < 125; ++n) wrong |= int(misses(quarter[n], found[n]));
    if (wrong == 0) {
      halves.insert(halves.end(), half, half + 27);
      return std::int32_t(halves.size() / 27);
    }
    quarters.insert(quarters.end(), quarter, quarter + 125);
    return -std::int32_t(quarters.size() / 125);
  }

  const FieldData& out_;
  const FineNodes& nodes_;
  float allowed_;
};

void take_finer(std::vector<std::unique_ptr<Finer>>& chosen, FieldData& out) {
  std::size_t halves = 0, quarters = 0, bricks = 0;
  for (const auto& c : chosen) {
    if (!c) continue;
    halves += c->halves.size();
    quarters += c->quarters.size();
    ++bricks;
  }
  if (bricks == 0) return;
  out.refined.assign(chosen.size(), -1);
  out.fine_index.reserve(512 * bricks);
  out.halves.reserve(halves);
  out.quarters.reserve(quarters);
  for (std::size_t row = 0; row < chosen.size(); ++row) {
    if (!chosen[row]) continue;
    const Finer& c = *chosen[row];
    out.refined[row] = std::int32_t(out.fine_index.size() / 512);
    for (const std::int32_t i : c.index) {  // in the order of cells, as files keep them
      if (i > 0) {
        const auto from = c.halves.begin() + 27 * (i - 1);
        out.halves.insert(out.halves.end(), from, from + 27);
      } else if (i < 0) {
        const auto from = c.quarters.begin() + 125 * (-1 - i);
        out.quarters.insert(out.quarters.end(), from, from + 125);
      }
      out.fine_index.push_back(i > 0   ? std::int32_t(out.half_count())
                               : i < 0 ? -std::int32_t(out.quarter_count())
                                       : 0);
    }
    chosen[row].reset();
  }
}

// The far bounds of the coarse bake, on the sides of the fine one. Inside, a bound m comes from the
// sqrt(m^2 + offset^2) to the mesh, or from less than the offset (io/bake/far.cpp); outside, the
// zero set may be nearer to it by the offset.
void take_far(const FieldData& coarse, const FineNodes& nodes, FieldData& out) {
  const std::array<std::int32_t, 3> size{out.bricks[0] + 1, out.bricks[1] + 1, out.bricks[2] + 1};
  out.far_grid.resize(coarse.far_grid.size());
  for (std::size_t i = 0; i < out.far_grid.size(); ++i) {
    const GridNode n = place_of(i, size);
    const float known = coarse.far_grid[i], o = float(out.offset);
    float bound = std::fabs(known);
    const bool inside = nodes.inside({kCut * n[0], kCut * n[1], kCut * n[2]});
    if (known < 0 && !inside) bound = bound <= o ? 0 : std::sqrt(bound * bound + o * o) - o;
    out.far_grid[i] = inside ? -bound : bound;
  }
}

// The fine bricks of one coarse brick.
std::uint64_t suspects_of(const FieldData& coarse, const FieldData& middle, const GridNode& brick,
                          float allowed, float tested) {
  float corners[kBox], exact[kernels::kMissedBoxRoom] = {}, corner[125];
  bool read = false;
  std::uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) {
    const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
    if (!read_box(middle, {2 * brick[0] + x, 2 * brick[1] + y, 2 * brick[2] + z}, exact)) continue;
    if (!read && !read_box(coarse, brick, corners)) std::fill_n(corners, kBox, kUnknown);
    read = true;
    for (int row = 0; row < 25; ++row)
      std::copy_n(corners + 81 * (4 * z + row / 5) + 9 * (4 * y + row % 5) + 4 * x, 5,
                  corner + 5 * row);
    const unsigned halves = kernels::missed_halves(corner, 4, exact, allowed, tested);
    for (int k = 0; k < 8; ++k)
      if (halves >> k & 1)
        bits |= std::uint64_t{1} << (16 * (2 * z + (k >> 2)) + 4 * (2 * y + (k >> 1 & 1)) + 2 * x +
                                     (k & 1));
  }
  return bits;
}

}  // namespace

std::vector<std::uint64_t> suspect_bricks(const FieldData& coarse, const FieldData& middle,
                                          double tolerance, unsigned threads) {
  const float allowed = float(kSuspected * tolerance);
  const float tested = float(middle.band + kTestedBeyondBand * middle.voxel_size);
  std::vector<std::uint64_t> bits(coarse.brick_index.size());
  sched::parallel_for(bits.size(), threads, [&](std::size_t c) {
    bits[c] = suspects_of(coarse, middle, place_of(c, coarse.bricks), allowed, tested);
  });
  return bits;
}

std::optional<FieldData> refine(FieldData coarse, FieldData fine,
                                const std::vector<std::uint8_t>& inside, double tolerance,
                                std::uint64_t room, unsigned threads) {
  FieldData out;
  out.origin = coarse.origin;
  out.voxel_size = coarse.voxel_size;
  out.bricks = coarse.bricks;
  out.band = coarse.band;
  out.offset = fine.offset;
  out.grown = fine.grown;
  const FineNodes nodes(fine, inside);
  take_bricks(coarse, fine, nodes, threads, out);
  take_names(coarse, fine, out);
  std::vector<std::size_t> cell_of(out.brick_count());
  for (std::size_t c = 0; c < out.brick_index.size(); ++c)
    if (out.brick_index[c] >= 0) cell_of[std::size_t(out.brick_index[c])] = c;
  const Chooser chooser(out, nodes, tolerance);
  std::vector<std::unique_ptr<Finer>> chosen(cell_of.size());
  // The finer samples are here once beside the fine bricks, and twice when these are gone.
  const auto bytes = [](const Samples& s) { return s.size() * sizeof(float); };
  room -= std::min<std::uint64_t>(room, bytes(out.samples));
  room = std::min(room, room / 2 + (bytes(fine.samples) + bytes(coarse.samples)) / 2);
  std::atomic<std::uint64_t> taken{0};  // bytes
  sched::parallel_for(cell_of.size(), threads, [&](std::size_t row) {
    if (taken.load(std::memory_order_relaxed) > room) return;
    chosen[row] = chooser.choose(place_of(cell_of[row], out.bricks));
    if (chosen[row]) taken.fetch_add(chosen[row]->bytes(), std::memory_order_relaxed);
  });
  if (taken > room) return std::nullopt;
  take_far(coarse, nodes, out);
  // The finer samples are here twice until they are joined, so the others go first.
  Samples().swap(fine.samples);
  Samples().swap(coarse.samples);
  take_finer(chosen, out);
  conform(threads, out);
  return out;
}

}  // namespace h6::io
