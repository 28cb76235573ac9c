// SPDX-License-Identifier: Apache-2.0
// sample_corners_ref.cpp - the specification of sample_corners.
#include "kernels/field/sample_corners.h"
#include "kernels/field/sample_field.h"

namespace h6::kernels {

void sample_corners_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                        float step, float* const at[4]) {
  for (int c = 0; c < 4; ++c) {
    Affine to = to_field;
    for (int axis = 0; axis < 3; ++axis) to.m[axis][3] += step * kCornerSign[c][axis];
    sample_field_ref(field, to, points, nullptr, points.count, at[c], nullptr, nullptr, nullptr);
  }
}

}  // namespace h6::kernels
