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
  const float* samples(std::size_t cell) const {
    return &field_.samples[512 * std::size_t(row(cell))];
  }
  // Whether the whole brick lies deeper inside than the band.
  bool deep(std::size_t cell) const {
    return row(cell) < 0 && far(place_of(cell, field_.bricks), 0) < 0;
  }

  // Lowers samples of a brick that is not deep to those of this field, or to a bound where it has
  // none: no surface is nearer than the band, nor than the far grid says at one of the corners.
  void lower(std::size_t cell, float* samples) const {
    if (row(cell) >= 0) {
      const float* own = this->samples(cell);
      for (int n = 0; n < 512; ++n) samples[n] = std::min(samples[n], own[n]);
      return;
    }
    const GridNode at = place_of(cell, field_.bricks);
    double corner[8], everywhere = field_.band;
    for (int k = 0; k < 8; ++k) {
      corner[k] = std::fabs(far(at, k));
      everywhere = std::max(everywhere, corner[k] - away(8, 8, 8));
    }
    if (*std::max_element(samples, samples + 512) <= everywhere) return;
    for (int n = 0; n < 512; ++n) {
      if (samples[n] <= everywhere) continue;  // eight roots are dear
      const int x = n % 8, y = n / 8 % 8, z = n / 64;
      double bound = field_.band;
      for (int k = 0; k < 8; ++k)
        bound = std::max(bound,
                         corner[k] - away(8 * (k & 1) - x, 8 * (k >> 1 & 1) - y, 8 * (k >> 2) - z));
      samples[n] = std::min(samples[n], float(bound));
    }
  }

 private:
  double away(int x, int y, int z) const {
    return field_.voxel_size * std::sqrt(double(x * x + y * y + z * z));
  }
  float far(const GridNode& brick, int corner) const {
    return field_.far_grid[place_in(
        {brick[0] + (corner & 1), brick[1] + (corner >> 1 & 1), brick[2] + (corner >> 2)},
        corners_)];
  }

  const FieldData& field_;
  std::array<std::int32_t, 3> corners_;
};

}  // namespace

FieldData unite(FieldData a, const FieldData& b, unsigned threads) {
  const Half first(a), second(b);
  Large<std::int32_t> brick_index(a.brick_index.size());
  std::int32_t rows = 0;
  for (std::size_t c = 0; c < brick_index.size(); ++c) {
    const bool any = first.row(c) >= 0 || second.row(c) >= 0;
    brick_index[c] = any && !first.deep(c) && !second.deep(c) ? rows++ : -1;
  }
  Samples samples(512 * std::size_t(rows));
  std::vector<std::int32_t> triangle(std::size_t(rows), -1),
      part(a.part.empty() ? 0 : std::size_t(rows), 0);
  sched::parallel_for(brick_index.size(), threads, [&](std::size_t c) {
    if (brick_index[c] < 0) return;
    const std::size_t to = std::size_t(brick_index[c]);
    constexpr std::size_t kMiddle = (4 * 8 + 4) * 8 + 4;
    const bool of_first =
        second.row(c) < 0 ||
        (first.row(c) >= 0 && first.samples(c)[kMiddle] < second.samples(c)[kMiddle]);
    std::copy_n((of_first ? first : second).samples(c), 512, &samples[512 * to]);
    (of_first ? second : first).lower(c, &samples[512 * to]);
    const FieldData& nearer = of_first ? a : b;
    const std::size_t from = std::size_t(nearer.brick_index[c]);
    triangle[to] = nearer.triangle[from];
    if (!part.empty()) part[to] = nearer.part[from];
  });
  for (std::size_t i = 0; i < a.far_grid.size(); ++i)
    a.far_grid[i] = std::min(a.far_grid[i], b.far_grid[i]);
  a.brick_index = std::move(brick_index);
  a.samples = std::move(samples);
  a.triangle = std::move(triangle);
  a.part = std::move(part);
  return a;
}

}  // namespace h6::io
