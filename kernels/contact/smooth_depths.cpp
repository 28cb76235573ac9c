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
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// The error of the trilinear distance, the slope that takes the gradient's place, and its share.
struct Smooth {
  VF error, slope[3], share;
};
HWY_INLINE Smooth smooth_at(const Crosses& crosses, const Affine& to_field,
                            const PointsView& points, std::size_t i, std::size_t live) {
  const DF d;
  const VF one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f), zero = hn::Zero(d);
  const VF here = load_n(d, crosses.at[0] + i, live), twice = hn::Add(here, here);
  const VF x = load_n(d, points.x + i, live), y = load_n(d, points.y + i, live);
  const VF z = load_n(d, points.z + i, live);
  VF error = zero, sharp = zero, steep2 = zero, slope[3];
  VF room = hn::Sub(hn::Set(d, crosses.band - 1), hn::Abs(here));
  for (int k = 0; k < 3; ++k) {
    const VF above = load_n(d, crosses.at[2 * k + 1] + i, live);
    const VF below = load_n(d, crosses.at[2 * k + 2] + i, live);
    const VF f = hn::Sub(hn::Add(above, below), twice);
    const VF place = affine_row(to_field.m[k], x, y, z), t = hn::Sub(place, hn::Floor(place));
    error = hn::MulAdd(hn::NegMulAdd(t, t, t), hn::Mul(f, half), error);
    sharp = hn::Add(sharp, hn::Abs(f));
    slope[k] = hn::Mul(hn::Sub(above, below), half);
    steep2 = hn::MulAdd(slope[k], slope[k], steep2);
    const VF beyond = hn::Sub(hn::Set(d, crosses.last[k] - 1), place);
    room = hn::Min(room, hn::Min(hn::Sub(place, one), beyond));
  }
  const VF sure = hn::Min(hn::Max(hn::Add(room, room), zero), one);
  const VF part = hn::Mul(sharp, hn::Set(d, 1 / kSmoothTo));
  const VF even = hn::Mul(sure, hn::Max(hn::NegMulAdd(part, part, one), zero));
  return {
      hn::Mul(even, error), {slope[0], slope[1], slope[2]}, hn::Mul(even, hn::Min(steep2, one))};
}

void smooth_simd(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                 float voxel, float* depth, float* gx, float* gy, float* gz) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const VF unit = hn::Set(d, voxel), per_full = hn::Set(d, 1 / (kSmoothFrom * voxel));
  float* const to[3] = {gx, gy, gz};
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const std::size_t live = points.count - i;
    const Smooth smooth = smooth_at(crosses, to_field, points, i, live);
    const VF deep = load_n(d, depth + i, live);
    const VF inside = hn::Min(hn::Max(hn::Mul(deep, per_full), zero), one);
    store_n(hn::MulAdd(hn::Mul(unit, smooth.error), inside, deep), d, depth + i, live);
    VF g[3], length2 = zero;
    for (int k = 0; k < 3; ++k) {
      VF s = hn::Mul(hn::Set(d, crosses.turn[3 * k]), smooth.slope[0]);
      for (int axis = 1; axis < 3; ++axis)
        s = hn::MulAdd(hn::Set(d, crosses.turn[3 * k + axis]), smooth.slope[axis], s);
      const VF old = load_n(d, to[k] + i, live);
      g[k] = hn::MulAdd(smooth.share, hn::Sub(s, old), old);
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
