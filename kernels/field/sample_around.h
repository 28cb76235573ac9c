// SPDX-License-Identifier: Apache-2.0
// sample_around.h - signed distances at a few places about each of many points: at the corners of a
// tetrahedron, and at the ends of a cross.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// The places, from the point, along the axes of the field, in steps.
inline constexpr int kCornerSign[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
inline constexpr int kEndSign[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};

// at[c][k] is the distance at `to_field` of point k plus step kCornerSign[c], as sample_field gives
// it, to the bit. `step` [voxel]: half an edge of the cube that holds the tetrahedron.
void sample_corners(const FieldView& field, const Affine& to_field, const PointsView& points,
                    float step, float* const at[4]);
void sample_corners_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                        float step, float* const at[4]);

// The same with kEndSign and steps of one voxel. Each end has the fractions of the point's own
// cell, so its distance differs from that of sample_field by rounding: 1e-4 voxel in grids of
// 1,024.
void sample_ends(const FieldView& field, const Affine& to_field, const PointsView& points,
                 float* const at[6]);
void sample_ends_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                     float* const at[6]);

}  // namespace h6::kernels
