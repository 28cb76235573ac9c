// SPDX-License-Identifier: Apache-2.0
// smooth_depths.cpp - the SIMD twin of smooth_depths_ref.cpp.
#include "kernels/contact/smooth_depths.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/smooth_depths.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

// The place of points in their cells on one axis, 0 to 1.
HWY_INLINE VF in_cell(const float* m, VF x, VF y, VF z) {
  const DF d;
  VF at = hn::MulAdd(hn::Set(d, m[2]), z, hn::Set(d, m[3]));
  at = hn::MulAdd(hn::Set(d, m[0]), x, hn::MulAdd(hn::Set(d, m[1]), y, at));
  return hn::Sub(at, hn::Floor(at));
}

// The error of trilinear interpolation, of the distance and of its gradient in field axes.
struct Error {
  VF distance, tilt[3];
};
HWY_INLINE Error error_at(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                          std::size_t i, std::size_t live) {
  const DF d;
  const VF one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f),
           here = load_n(d, crosses.at[0] + i, live);
  const VF x = load_n(d, points.x + i, live), y = load_n(d, points.y + i, live);
  const VF z = load_n(d, points.z + i, live), twice = hn::Add(here, here);
  VF distance = hn::Zero(d), sharp = distance, tilt[3];
  for (int k = 0; k < 3; ++k) {
    const VF above = load_n(d, crosses.at[2 * k + 1] + i, live);
    const VF f = hn::Sub(hn::Add(above, load_n(d, crosses.at[2 * k + 2] + i, live)), twice);
    const VF t = in_cell(to_field.m[k], x, y, z), bent = hn::Mul(f, half);
    distance = hn::MulAdd(hn::NegMulAdd(t, t, t), bent, distance);
    tilt[k] = hn::Mul(hn::NegMulAdd(hn::Add(one, one), t, one), bent);
    sharp = hn::Add(sharp, hn::Abs(f));
  }
  VF sure = hn::Sub(hn::Set(d, 2 * (crosses.band - 1)), hn::Abs(twice));
  sure = hn::Min(hn::Max(sure, hn::Zero(d)), one);
  const VF part = hn::Mul(sharp, hn::Set(d, 1 / kSmoothTo));
  const VF even = hn::Mul(sure, hn::Max(hn::NegMulAdd(part, part, one), hn::Zero(d)));
  return {hn::Mul(even, distance),
          {hn::Mul(even, tilt[0]), hn::Mul(even, tilt[1]), hn::Mul(even, tilt[2])}};
}

void smooth_simd(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                 float voxel, float* depth, float* gx, float* gy, float* gz) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const VF unit = hn::Set(d, voxel), per_full = hn::Set(d, 1 / (kSmoothFrom * voxel));
  float* const to[3] = {gx, gy, gz};
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const std::size_t live = points.count - i;
    const Error error = error_at(crosses, to_field, points, i, live);
    const VF deep = load_n(d, depth + i, live);
    const VF inside = hn::Min(hn::Max(hn::Mul(deep, per_full), zero), one);
    store_n(hn::MulAdd(hn::Mul(unit, error.distance), inside, deep), d, depth + i, live);
    VF g[3], length2 = zero;
    for (int k = 0; k < 3; ++k) {
      g[k] = load_n(d, to[k] + i, live);
      for (int axis = 0; axis < 3; ++axis)
        g[k] = hn::NegMulAdd(hn::Set(d, crosses.turn[3 * k + axis]), error.tilt[axis], g[k]);
      length2 = hn::MulAdd(g[k], g[k], length2);
    }
    const VF scale = hn::Div(one, hn::Sqrt(length2));
    for (int k = 0; k < 3; ++k) store_n(hn::Mul(g[k], scale), d, to[k] + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(smooth_simd);

void smooth_depths(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                   float voxel, float* depth, float* gx, float* gy, float* gz) {
  HWY_DYNAMIC_DISPATCH(smooth_simd)(crosses, to_field, points, voxel, depth, gx, gy, gz);
}

}  // namespace h6::kernels
#endif
