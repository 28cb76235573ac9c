// SPDX-License-Identifier: Apache-2.0
// unite.cpp - see unite.h. Lengths are metres.
#include "io/field/unite.h"

#include <algorithm>
#include <cmath>

#include "io/field/box.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// One field, brick by brick.
class Half {
 public:
  explicit Half(const FieldData& field)
      : field_(field), corners_{field.bricks[0] + 1, field.bricks[1] + 1, field.bricks[2] + 1} {}

  std::int32_t row(std::size_t cell) const { return field_.brick_index[cell]; }
  // Whether the whole brick lies deeper inside than the band.
  bool deep(std::size_t cell) const {
    return row(cell) < 0 && far(place_of(cell, field_.bricks), 0) < 0;
  }

  // The samples of a brick. Without a brick, a bound: no surface is nearer than the band, nor than
  // the far grid says at one of the corners.
  void samples(std::size_t cell, float (&out)[512]) const {
    if (const std::int32_t r = row(cell); r >= 0) {
      std::copy_n(&field_.samples[512 * std::size_t(r)], 512, out);
      return;
    }
    const GridNode at = place_of(cell, field_.bricks);
    double corner[8];
    for (int k = 0; k < 8; ++k) corner[k] = std::fabs(far(at, k));
    const double voxel = field_.voxel_size;
    for (int n = 0; n < 512; ++n) {
      const int p[3] = {n % 8, n / 8 % 8, n / 64};
      double bound = field_.band;
      for (int k = 0; k < 8; ++k) {
        const int d[3] = {8 * (k & 1) - p[0], 8 * (k >> 1 & 1) - p[1], 8 * (k >> 2) - p[2]};
        const double away = std::sqrt(double(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        bound = std::max(bound, corner[k] - voxel * away);
      }
      out[n] = float(far(at, 0) < 0 ? -bound : bound);
    }
  }

 private:
  float far(const GridNode& brick, int corner) const {
    return field_.far_grid[place_in(
        {brick[0] + (corner & 1), brick[1] + (corner >> 1 & 1), brick[2] + (corner >> 2)},
        corners_)];
  }

  const FieldData& field_;
  std::array<std::int32_t, 3> corners_;
};

}  // namespace

FieldData unite(const FieldData& a, const FieldData& b, unsigned threads) {
  const Half first(a), second(b);
  const std::size_t cells = a.brick_index.size();
  FieldData out = a;
  std::int32_t rows = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    const bool any = first.row(c) >= 0 || second.row(c) >= 0;
    out.brick_index[c] = any && !first.deep(c) && !second.deep(c) ? rows++ : -1;
  }
  out.samples.resize(512 * std::size_t(rows));
  out.triangle.assign(std::size_t(rows), -1);
  out.part.assign(a.part.empty() ? 0 : std::size_t(rows), 0);
  sched::parallel_for(cells, threads, [&](std::size_t c) {
    if (out.brick_index[c] < 0) return;
    const std::size_t to = std::size_t(out.brick_index[c]);
    float left[512], right[512];
    first.samples(c, left);
    second.samples(c, right);
    for (std::size_t n = 0; n < 512; ++n) out.samples[512 * to + n] = std::min(left[n], right[n]);
    constexpr std::size_t kMiddle = (4 * 8 + 4) * 8 + 4;
    const bool of_first =
        second.row(c) < 0 || (first.row(c) >= 0 && left[kMiddle] < right[kMiddle]);
    const FieldData& nearer = of_first ? a : b;
    const std::size_t from = std::size_t(nearer.brick_index[c]);
    out.triangle[to] = nearer.triangle[from];
    if (!out.part.empty()) out.part[to] = nearer.part[from];
  });
  for (std::size_t i = 0; i < out.far_grid.size(); ++i)
    out.far_grid[i] = std::min(a.far_grid[i], b.far_grid[i]);
  return out;
}

}  // namespace h6::io
