// SPDX-License-Identifier: Apache-2.0
#include "io/field/field_data.h"

namespace h6::io {

h6FieldDef FieldData::def() const {
  h6FieldDef d{};
  d.origin = origin;
  d.voxel_size = voxel_size;
  for (std::size_t k = 0; k < 3; ++k) d.bricks[k] = bricks[k];
  d.brick_index = brick_index.data();
  d.samples = samples.data();
  d.brick_count = brick_count();
  d.far_grid = far_grid.data();
  d.band = band;
  d.part = part.empty() ? nullptr : part.data();
  d.triangle = triangle.empty() ? nullptr : triangle.data();
  if (refined.empty()) return d;
  d.refined = refined.data();
  d.fine_index = fine_index.data();
  d.refined_count = fine_index.size() / 512;
  d.halves = halves.data();
  d.half_count = half_count();
  d.quarters = quarters.data();
  d.quarter_count = quarter_count();
  return d;
}

namespace {

bool fine_consistent(const FieldData& f) {
  if (f.halves.size() % 27 != 0 || f.quarters.size() % 125 != 0) return false;
  if (f.refined.empty()) return f.fine_index.empty() && f.halves.empty() && f.quarters.empty();
  std::int32_t rows = 0;
  for (const std::int32_t row : f.refined)
    if (row != -1 && row != rows++) return false;
  if (f.refined.size() != f.brick_count() || f.fine_index.size() != 512 * std::size_t(rows))
    return false;
  for (const std::int64_t i : f.fine_index)
    if (i > std::int64_t(f.half_count()) || -i > std::int64_t(f.quarter_count())) return false;
  return true;
}

}  // namespace

bool consistent(const FieldData& f) {
  std::size_t cells = 1, nodes = 1, used = 0;
  for (const std::int32_t n : f.bricks) {
    if (n < 1 || n > kMaxBricksOnSide) return false;
    cells *= std::size_t(n);
    nodes *= std::size_t(n) + 1;
  }
  for (const std::int32_t row : f.brick_index) {
    if (row >= 0 && std::size_t(row) >= f.brick_count()) return false;
    used += row >= 0;
  }
  return f.brick_index.size() == cells && f.far_grid.size() == nodes &&
         f.samples.size() % 512 == 0 && used == f.brick_count() &&
         (f.part.empty() || f.part.size() == f.brick_count()) &&
         (f.triangle.empty() || f.triangle.size() == f.brick_count()) && fine_consistent(f);
}

}  // namespace h6::io
