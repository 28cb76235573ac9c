// SPDX-License-Identifier: Apache-2.0
// sample_around_ref.cpp - the specification of sample_around.
#include "kernels/field/sample_around.h"
#include "kernels/field/sample_field.h"

namespace h6::kernels {
namespace {

template <int kCount>
void sample_at(const int (&sign)[kCount][3], const FieldView& field, const Affine& to_field,
               const PointsView& points, float step, float* const* at) {
  for (int c = 0; c < kCount; ++c) {
    Affine to = to_field;
    for (int axis = 0; axis < 3; ++axis) to.m[axis][3] += step * sign[c][axis];
    sample_field_ref(field, to, points, nullptr, points.count, at[c], nullptr, nullptr, nullptr);
  }
}

}  // namespace

void sample_corners_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                        float step, float* const at[4]) {
  sample_at(kCornerSign, field, to_field, points, step, at);
}

void sample_ends_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                     float* const at[6]) {
  sample_at(kEndSign, field, to_field, points, 1, at);
}

}  // namespace h6::kernels
