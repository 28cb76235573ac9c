// SPDX-License-Identifier: Apache-2.0
// sample_around.h - signed distances at the ends of a cross about each of many points.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// The ends, from the point, along the axes of the field, in steps.
inline constexpr int kEndSign[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};

// at[c][k] is the distance at `to_field` of point k plus step kEndSign[c], as sample_field gives
// it, but for rounding: 1e-4 voxel in grids of 1,024. `step` [voxel].
void sample_cross(const FieldView& field, const Affine& to_field, const PointsView& points,
                  float step, float* const at[6]);
void sample_cross_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                      float step, float* const at[6]);

// The same with steps of one voxel, at[0 .. 5], and of half a voxel, at[6 .. 11]. Each place has
// the fractions of the point's own cell, so its distance differs from that of sample_field by
// rounding: 1e-4 voxel in grids of 1,024.
void sample_ends(const FieldView& field, const Affine& to_field, const PointsView& points,
                 float* const at[12]);
void sample_ends_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                     float* const at[12]);

}  // namespace h6::kernels
