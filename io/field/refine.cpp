// SPDX-License-Identifier: Apache-2.0
// refine.cpp - which cells of a coarse field need finer samples, and those samples.
//
// Lengths are metres. A fine node is named by its numbers in the fine grid; every fourth is a
// coarse node too.
#include "io/field/refine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "io/field/conform.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// Errors are measured at fine nodes and are larger between them, and faces towards coarser cells
// take the error of these: with 0.6 the worst place of a plate of 0.2 mm was 0.94 tolerances off.
constexpr double kMeasured = 0.3;
// Farther beyond its band, a node of the fine bake may hold a bound in place of a distance.
constexpr double kExactBeyondBand = 1.9;  // [fine voxel]
// A place in the band has a node within half a fine cell's diagonal, which may lie beyond the band.
constexpr double kTestedBeyondBand = 0.867;  // [fine voxel]

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// The nodes of the fine bake.
class FineNodes {
 public:
  explicit FineNodes(const FieldData& fine)
      : fine_(fine), exact_below_(float(fine.band + kExactBeyondBand * fine.voxel_size)) {
    for (std::size_t k = 0; k < 3; ++k) far_size_[k] = fine.bricks[k] + 1;
  }

  // The samples of fine brick `at`; null where there are none.
  const float* brick(const GridNode& at) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (at[k] >= fine_.bricks[k]) return nullptr;
    const std::int32_t row = fine_.brick_index[place_in(at, fine_.bricks)];
    return row < 0 ? nullptr : &fine_.samples[std::size_t(row) * 512];
  }
  bool exact(float sample) const { return std::fabs(sample) < exact_below_; }

  // The value at a coarse node, from whichever bake is exact there. `coarse`: the coarse bake's, or
  // null.
  float at_coarse_node(const GridNode& node, const float* coarse) const {
    const GridNode at{node[0] >> 3, node[1] >> 3, node[2] >> 3};
    const float* s = brick(at);
    const float fine =
        s == nullptr ? 0 : s[((node[2] & 7) * 8 + (node[1] & 7)) * 8 + (node[0] & 7)];
    if (s != nullptr && (coarse == nullptr || exact(fine))) return fine;
    const bool inside =
        s != nullptr ? fine < 0 : std::signbit(fine_.far_grid[place_in(at, far_size_)]);
    if (coarse == nullptr) return inside ? -exact_below_ : exact_below_;
    if ((*coarse < 0) == inside) return *coarse;
    // The fine bake saw a gap open, or closed, where the coarse one did not.
    return -*coarse - 2 * float(fine_.offset);
  }

  // The least |distance| that the far grid knows at its nodes in a coarse brick.
  double least_far(const GridNode& brick) const {
    double least = 1e30;
    for (int i = 0; i < 125; ++i) {
      const GridNode n{kCut * brick[0] + i % 5, kCut * brick[1] + i / 5 % 5,
                       kCut * brick[2] + i / 25};
      least = std::min(least, std::fabs(double(fine_.far_grid[place_in(n, far_size_)])));
    }
    return least;
  }
  float far(const GridNode& node) const { return fine_.far_grid[place_in(node, far_size_)]; }

 private:
  const FieldData& fine_;
  float exact_below_;
  std::array<std::int32_t, 3> far_size_{};
};

// The coarse bricks: those of the coarse bake, and those near a surface that only the fine bake has
// (a groove that it keeps open, say).
void take_bricks(const FieldData& coarse, const FieldData& fine, const FineNodes& nodes,
                 unsigned threads, FieldData& out) {
  const std::size_t cells = coarse.brick_index.size();
  out.brick_index.assign(cells, -1);
  // Nodes of the far grid are 2 voxels apart. A surface at the band's end beside a brick lies at
  // most sqrt(band^2 + 2) voxels from one of them.
  const double band = coarse.band / coarse.voxel_size;
  const double near = std::sqrt(band * band + 2) * coarse.voxel_size + fine.voxel_size;
  sched::parallel_for(cells, threads, [&](std::size_t c) {
    if (coarse.brick_index[c] >= 0 || nodes.least_far(place_of(c, coarse.bricks)) < near)
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
    for (int n = 0; n < 512; ++n) {
      const GridNode node{32 * at[0] + 4 * (n % 8), 32 * at[1] + 4 * (n / 8 % 8),
                          32 * at[2] + 4 * (n / 64)};
      out.samples[row * 512 + std::size_t(n)] =
          nodes.at_coarse_node(node, samples == nullptr ? nullptr : samples + n);
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

// Trilinear values at 5 x 5 x 5 places in a cell of `kCount` nodes a side.
template <int kCount>
void interpolate(const float* nodes, float (&out)[125]) {
  constexpr int kStep = 4 / (kCount - 1);
  float lines[5 * kCount * kCount], planes[25 * kCount];
  const auto along = [](const float* from, int stride, int i) {
    const int low = std::min(i / kStep, kCount - 2);
    const float t = float(i - low * kStep) / kStep;
    return from[low * stride] + t * (from[(low + 1) * stride] - from[low * stride]);
  };
  for (int row = 0; row < kCount * kCount; ++row)
    for (int i = 0; i < 5; ++i) lines[5 * row + i] = along(nodes + kCount * row, 1, i);
  for (int z = 0; z < kCount; ++z)
    for (int i = 0; i < 5; ++i)
      for (int x = 0; x < 5; ++x)
        planes[25 * z + 5 * i + x] = along(lines + 5 * kCount * z + x, 5, i);
  for (int i = 0; i < 5; ++i)
    for (int n = 0; n < 25; ++n) out[25 * i + n] = along(planes + n, 25, i);
}

// The finer samples of one brick.
struct Finer {
  std::array<std::int32_t, 512> index{};  // as in FieldData, for these halves and quarters
  std::vector<float> halves, quarters;
};

// Decides for the cells of one coarse brick, one after the other.
class Chooser {
 public:
  Chooser(const FieldData& out, const FineNodes& nodes, double tolerance, double tested)
      : out_(out), nodes_(nodes), allowed_(float(kMeasured * tolerance)), tested_(float(tested)) {}

  // Returns null where the coarse samples are good enough.
  std::unique_ptr<Finer> choose(const GridNode& brick) const {
    std::unique_ptr<Finer> finer;
    for (int box = 0; box < 64; ++box) {  // of 2 x 2 x 2 cells, one fine brick
      const GridNode fine{kCut * brick[0] + box % 4, kCut * brick[1] + box / 4 % 4,
                          kCut * brick[2] + box / 16};
      const float* source[8];
      for (int k = 0; k < 8; ++k)
        source[k] = nodes_.brick({fine[0] + (k & 1), fine[1] + (k >> 1 & 1), fine[2] + (k >> 2)});
      if (source[0] == nullptr) continue;
      for (int i = 0; i < 8; ++i)
        try_cell({2 * fine[0] + (i & 1), 2 * fine[1] + (i >> 1 & 1), 2 * fine[2] + (i >> 2)},
                 source, finer);
    }
    return finer;
  }

 private:
  void try_cell(const GridNode& cell, const float* const (&source)[8],
                std::unique_ptr<Finer>& finer) const {
    float corner[8], exact[125], flat[125];
    for (int i = 0; i < 8; ++i) {
      const float* v = coarse_node(
          out_, {4 * (cell[0] + (i & 1)), 4 * (cell[1] + (i >> 1 & 1)), 4 * (cell[2] + (i >> 2))});
      if (v == nullptr) return;  // outside the band
      corner[i] = *v;
    }
    gather(cell, source, exact);
    interpolate<2>(corner, flat);
    if (!misses(exact, flat)) return;
    // A node that the fine bake does not know lies beyond the band.
    for (int n = 0; n < 125; ++n)
      if (!nodes_.exact(exact[n])) exact[n] = flat[n];
    if (!finer) finer = std::make_unique<Finer>();
    std::int32_t& index =
        finer->index[std::size_t(((cell[2] & 7) * 8 + (cell[1] & 7)) * 8 + (cell[0] & 7))];
    float half[27];
    for (int n = 0; n < 27; ++n) half[n] = exact[50 * (n / 9) + 10 * (n / 3 % 3) + 2 * (n % 3)];
    interpolate<3>(half, flat);
    if (!misses(exact, flat)) {
      finer->halves.insert(finer->halves.end(), half, half + 27);
      index = std::int32_t(finer->halves.size() / 27);
    } else {
      finer->quarters.insert(finer->quarters.end(), exact, exact + 125);
      index = -std::int32_t(finer->quarters.size() / 125);
    }
  }

  // The fine nodes of a cell; kUnknown where they lie in no brick.
  static void gather(const GridNode& cell, const float* const (&source)[8], float (&out)[125]) {
    const int x0 = 4 * (cell[0] & 1), y0 = 4 * (cell[1] & 1), z0 = 4 * (cell[2] & 1);
    for (int row = 0; row < 25; ++row) {
      const int y = y0 + row % 5, z = z0 + row / 5, from = (y >> 3) << 1 | (z >> 3) << 2;
      const int at = ((z & 7) * 8 + (y & 7)) * 8;
      const float *const four = source[from], *const last = source[from | (x0 + 4) >> 3];
      float* const to = out + 5 * row;
      if (four != nullptr)
        std::copy_n(four + at + x0, 4, to);
      else
        std::fill_n(to, 4, kUnknown);
      to[4] = last == nullptr ? kUnknown : last[at + ((x0 + 4) & 7)];
    }
  }

  // Nodes that are not exact are not tested: tested_ is less than what is exact.
  bool misses(const float (&exact)[125], const float (&found)[125]) const {
    int wrong = 0;
    for (int n = 0; n < 125; ++n)  // false for kUnknown
      wrong |= int(std::fabs(exact[n] - found[n]) > allowed_) & int(std::fabs(exact[n]) < tested_);
    return wrong != 0;
  }

  const FieldData& out_;
  const FineNodes& nodes_;
  float allowed_, tested_;
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

}  // namespace

FieldData refine(const FieldData& coarse, const FieldData& fine, double tolerance,
                 unsigned threads) {
  FieldData out;
  out.origin = coarse.origin;
  out.voxel_size = coarse.voxel_size;
  out.bricks = coarse.bricks;
  out.band = coarse.band;
  out.offset = fine.offset;
  out.grown = fine.grown;
  const FineNodes nodes(fine);
  take_bricks(coarse, fine, nodes, threads, out);
  take_names(coarse, fine, out);
  std::vector<std::size_t> cell_of(out.brick_count());
  for (std::size_t c = 0; c < out.brick_index.size(); ++c)
    if (out.brick_index[c] >= 0) cell_of[std::size_t(out.brick_index[c])] = c;
  const Chooser chooser(out, nodes, tolerance, fine.band + kTestedBeyondBand * fine.voxel_size);
  std::vector<std::unique_ptr<Finer>> chosen(cell_of.size());
  sched::parallel_for(cell_of.size(), threads, [&](std::size_t row) {
    chosen[row] = chooser.choose(place_of(cell_of[row], out.bricks));
  });
  take_finer(chosen, out);
  conform(threads, out);
  out.far_grid.resize(std::size_t(out.bricks[0] + 1) * std::size_t(out.bricks[1] + 1) *
                      std::size_t(out.bricks[2] + 1));
  for (std::size_t i = 0; i < out.far_grid.size(); ++i) {
    const GridNode n = place_of(i, {out.bricks[0] + 1, out.bricks[1] + 1, out.bricks[2] + 1});
    out.far_grid[i] = nodes.far({kCut * n[0], kCut * n[1], kCut * n[2]});
  }
  return out;
}

}  // namespace h6::io
