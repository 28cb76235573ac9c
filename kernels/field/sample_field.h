// SPDX-License-Identifier: Apache-2.0
// sample_field.h - signed distance and its gradient at many points.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// For k in 0..count-1, point rows[k] (or k itself when rows is null) of `points` is carried to the
// field by `to_field`; distance[k] in voxels, gx/gy/gz[k] its gradient per voxel in field axes, not
// normalised. Gradient columns may all be null.
//   in a brick        trilinear sample; its exact derivative
//   in a far cell     a bound with the sign of the side: |distance| <= true |d|, at least 0
//   (views.h);
//                     the derivative of what interpolates the corners, which points the right way
//   outside the grid  hypot(distance to the grid, value at the nearest grid point when positive)
// A point that is not finite has distance +infinity and gradient 0.
void sample_field(const FieldView& field, const Affine& to_field, const PointsView& points,
                  const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                  float* gy, float* gz);
void sample_field_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                      const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                      float* gy, float* gz);

}  // namespace h6::kernels
