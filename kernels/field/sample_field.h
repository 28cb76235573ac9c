// SPDX-License-Identifier: Apache-2.0
// sample_field.h - signed distance and its gradient at many points.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// For k in 0..count-1, `to_field` maps point rows[k] (k itself when rows is null) of `points` to
// the field. distance[k] is in voxels; gx/gy/gz[k] is its gradient per voxel in field axes, not
// normalised. The gradient columns may all be null.
//   in a brick        trilinear sample, of the finest nodes there are; its exact derivative
//   in a far cell     a bound with the sign of the side (views.h): 0 <= |distance| <= true |d|;
//                     the derivative of the interpolated corners
//   outside the grid  hypot(distance to the grid, value at the nearest grid point when positive)
// A point that is not finite has distance +infinity and gradient 0.
void sample_field(const FieldView& field, const Affine& to_field, const PointsView& points,
                  const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                  float* gy, float* gz);
void sample_field_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                      const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                      float* gy, float* gz);

}  // namespace h6::kernels
