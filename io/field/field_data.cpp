// SPDX-License-Identifier: Apache-2.0
// field_data.cpp - the view of a baked field that the engine takes.
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
  return d;
}

}  // namespace h6::io
