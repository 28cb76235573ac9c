// SPDX-License-Identifier: Apache-2.0
// sample_around_ref.cpp - the specification of sample_around.
#include "kernels/field/sample_around.h"
#include "kernels/field/sample_field.h"

namespace h6::kernels {

void sample_cross_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                      float step, float* const at[6]) {
  for (int c = 0; c < 6; ++c) {
    Affine to = to_field;
    for (int axis = 0; axis < 3; ++axis) to.m[axis][3] += step * kEndSign[c][axis];
    sample_field_ref(field, to, points, nullptr, points.count, at[c], nullptr, nullptr, nullptr);
  }
}

void sample_ends_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                     float* const at[12]) {
  sample_cross_ref(field, to_field, points, 1, at);
  sample_cross_ref(field, to_field, points, 0.5f, at + 6);
}

}  // namespace h6::kernels
