// SPDX-License-Identifier: Apache-2.0
// field_layout_test.cpp - far bounds are bounds, aprons meet their neighbours.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/field/field_layout.h"
#include "kernels/field/sample_field.h"
#include "tests/kernels/field/analytic_field.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

float distance_at(const AnalyticField& field, const Point& p) {
  const float x = float(p.x), y = float(p.y), z = float(p.z);
  float d;
  sample_field_ref(field.view(), kIdentity, {&x, &y, &z, 1}, nullptr, 1, &d, nullptr, nullptr,
                   nullptr);
  return d;
}

struct Gap {
  double mean = 0, worst_excess = 0;
  int points = 0, inside = 0;
};

// How far the bounds are below the distance; excess > 0 means that a bound is wrong.
Gap measure_bounds(const AnalyticField& field, int samples, std::uint64_t seed) {
  Random random(seed);
  Gap gap;
  while (gap.points < samples) {
    const Point p{float(random.uniform(0, field.last(0))), float(random.uniform(0, field.last(1))),
                  float(random.uniform(0, field.last(2)))};
    if (field.near(p)) continue;
    const double bound = distance_at(field, p), truth = field.distance(p);
    gap.worst_excess = std::max(gap.worst_excess, std::fabs(bound) - std::fabs(truth));
    if (bound * truth < 0) gap.worst_excess = 1e9;
    gap.mean += std::fabs(truth) - std::fabs(bound);
    gap.inside += truth < 0;
    ++gap.points;
  }
  gap.mean /= gap.points;
  return gap;
}

}  // namespace

TEST_CASE(
    "field_layout: the far bound never exceeds the distance and keeps its side, and is tight") {
  const AnalyticField field(16, 17, 18, clutter);
  const Gap gap = measure_bounds(field, 1000000, 1);
  MESSAGE("mean gap of the far bound " << gap.mean << " voxel");
  CHECK(gap.worst_excess <= 0.0);
  CHECK(gap.inside > 100);
  CHECK(gap.mean < 0.4);

  const AnalyticField cavity(16, 17, 18, [](const Point& p) { return -clutter(p); });
  const Gap turned = measure_bounds(cavity, 20000, 7);
  CHECK(turned.worst_excess <= 0.0);
  CHECK(turned.inside > 10000);
  CHECK(turned.mean < 0.4);
}

TEST_CASE(
    "field_layout: the bound holds around a single point, where interpolation overestimates most") {
  Random random(5);
  for (int i = 0; i < 30; ++i) {
    const Point c{random.uniform(24, 40), random.uniform(24, 40), random.uniform(24, 40)};
    const AnalyticField field(8, 8, 8, [c](const Point& p) { return sphere(p, c, 1e-9); });
    CHECK(measure_bounds(field, 5000, 100 + i).worst_excess <= 0.0);
  }
}

TEST_CASE("field_layout: a far grid of loose lower bounds still gives bounds") {
  const AnalyticField field(16, 17, 18, clutter, 3.0, 0.37, 0.3);
  CHECK(measure_bounds(field, 100000, 2).worst_excess <= 0.0);
}

TEST_CASE("field_layout: a far cell whose corners disagree on the side is bounded by 0") {
  h6FieldDef def{};
  def.voxel_size = 1;
  def.band = 3;
  def.bricks[0] = def.bricks[1] = def.bricks[2] = 1;
  const std::int32_t index = -1;
  const float far[8] = {9, 9, 9, -9, 9, 9, 9, 9};
  def.brick_index = &index;
  def.far_grid = far;
  std::int32_t table;
  std::int16_t corner[8];
  layout_table(def, &table);
  CHECK(table == -1);
  layout_row(def, &table, 0, nullptr, corner);
  for (std::int16_t v : corner) CHECK(v == 0);
}

TEST_CASE("field_layout: every brick's last layer repeats its neighbours' first") {
  const AnalyticField field(16, 17, 18, clutter);
  const FieldView view = field.view();
  int faces = 0;
  for (std::int32_t c = 0; c + 1 < 18; ++c)
    for (std::int32_t b = 0; b + 1 < 17; ++b)
      for (std::int32_t a = 0; a + 1 < 16; ++a)
        for (int corner = 1; corner < 8; ++corner) {
          const int step[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
          const std::int32_t own = view.table[(c * 17 + b) * 16 + a];
          const std::int32_t other =
              view.table[((c + step[2]) * 17 + b + step[1]) * 16 + a + step[0]];
          if (own < 0 || other < 0) continue;
          ++faces;
          int differences = 0;
          for (int z = step[2] ? 8 : 0; z < (step[2] ? 9 : 8); ++z)
            for (int y = step[1] ? 8 : 0; y < (step[1] ? 9 : 8); ++y)
              for (int x = step[0] ? 8 : 0; x < (step[0] ? 9 : 8); ++x) {
                const auto node = [](const FieldView& v, std::int32_t row, int i, int j, int k) {
                  return v.bricks[std::size_t(row) * kBrickStride + (k * 9 + j) * 9 + i];
                };
                differences += node(view, own, x, y, z) !=
                               node(view, other, x - 8 * step[0], y - 8 * step[1], z - 8 * step[2]);
              }
          CHECK(differences == 0);
        }
  CHECK(faces > 500);
}

TEST_CASE(
    "field_layout: apron nodes that no brick holds are bounds outside the band, on the right "
    "side") {
  const AnalyticField field(16, 17, 18, clutter);
  const FieldView view = field.view();
  int nodes = 0;
  for (std::int32_t c = 0; c < 18; ++c)
    for (std::int32_t b = 0; b < 17; ++b)
      for (std::int32_t a = 0; a + 1 < 16; ++a) {
        const std::int32_t own = view.table[(c * 17 + b) * 16 + a];
        if (own < 0 || view.table[(c * 17 + b) * 16 + a + 1] >= 0) continue;
        for (int z = 0; z < 8; ++z)
          for (int y = 0; y < 8; ++y) {
            const double held =
                kNearQuantum * view.bricks[std::size_t(own) * kBrickStride + (z * 9 + y) * 9 + 8];
            const double truth = field.distance({8.0 * a + 8, 8.0 * b + y, 8.0 * c + z});
            CHECK(std::fabs(held) >= 3.0 - 1e-3);
            CHECK(std::fabs(held) <= std::fabs(truth) + 1e-3);
            CHECK(held * truth > 0);
            ++nodes;
          }
      }
  CHECK(nodes > 1000);
}

TEST_CASE("field_layout: distances beyond the range of an int16 are clamped") {
  const AnalyticField field(
      2, 2, 2, [](const Point& p) { return 100.0 * p.x - 400.0; }, 1e6, 0.5);
  CHECK(distance_at(field, {0, 3, 3}) == h6::test::near(-32).epsilon(1e-4));
  CHECK(distance_at(field, {15, 3, 3}) == h6::test::near(32).epsilon(1e-4));
  CHECK(distance_at(field, {4, 3, 3}) == 0.0f);
  // Bounds of far cells are clamped to their own range: 1024 voxels.
  const AnalyticField wide(4, 1, 1, [](const Point& p) { return 5000.0 + p.x; });
  CHECK(distance_at(wide, {10, 3, 3}) == h6::test::near(1024).epsilon(1e-3));
}

TEST_CASE("field_layout: rows follow the table, and the size says how many there are") {
  const AnalyticField field(16, 17, 18, clutter);
  const FieldLayoutSize size = field_layout_size(field.def());
  const FieldView view = field.view();
  std::int32_t brick = 0, far = 0;
  for (std::size_t slot = 0; slot < 16 * 17 * 18; ++slot) {
    CHECK(view.table[slot] == (field.def().brick_index[slot] >= 0 ? brick++ : -1 - far++));
  }
  CHECK(size.bricks == std::size_t(brick));
  CHECK(size.far_cells == std::size_t(far));
  CHECK(size.bricks == field.brick_count());
}
