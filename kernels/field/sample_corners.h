// SPDX-License-Identifier: Apache-2.0
// sample_corners.h - signed distances at the four corners of a tetrahedron about each of many
// points.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// The corners, from the point, along the axes of the field, in steps.
inline constexpr int kCornerSign[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};

// at[c][k] is the distance at `to_field` of point k plus step kCornerSign[c], as sample_field gives
// it, to the bit. `step` [voxel]: half an edge of the cube that holds the tetrahedron.
void sample_corners(const FieldView& field, const Affine& to_field, const PointsView& points,
                    float step, float* const at[4]);
void sample_corners_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                        float step, float* const at[4]);

}  // namespace h6::kernels
