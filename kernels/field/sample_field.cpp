// SPDX-License-Identifier: Apache-2.0
// sample_field.cpp - the SIMD twin of sample_field_ref.cpp.
#include "kernels/field/sample_field.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/sample_field.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

template <bool kGradient>
HWY_INLINE void sample_lanes(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const Lanes& lanes, float* distance,
                             float* gx, float* gy, float* gz) {
  const VI row = load_rows(lanes);
  const VF px = load_column(points.x, lanes, row);
  const VF py = load_column(points.y, lanes, row);
  const VF pz = load_column(points.z, lanes, row);
  VF value, dx, dy, dz;
  sample_points<kGradient>(field, affine_row(to_field.m[0], px, py, pz),
                           affine_row(to_field.m[1], px, py, pz),
                           affine_row(to_field.m[2], px, py, pz), value, dx, dy, dz);
  store_n(value, DF(), distance + lanes.first, lanes.live);
  if (kGradient) {
    store_n(dx, DF(), gx + lanes.first, lanes.live);
    store_n(dy, DF(), gy + lanes.first, lanes.live);
    store_n(dz, DF(), gz + lanes.first, lanes.live);
  }
}

template <bool kGradient>
HWY_INLINE void sample_all(const FieldView& field, const Affine& to_field, const PointsView& points,
                           const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                           float* gy, float* gz) {
  const std::size_t width = hn::Lanes(DF());
  std::size_t k = 0;
  for (; k + width <= count; k += width) {
    sample_lanes<kGradient>(field, to_field, points, {rows, k, width}, distance, gx, gy, gz);
  }
  if (k < count) {
    sample_lanes<kGradient>(field, to_field, points, {rows, k, count - k}, distance, gx, gy, gz);
  }
}

void sample_field_simd(const FieldView& field, const Affine& to_field, const PointsView& points,
                       const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                       float* gy, float* gz) {
  if (gx != nullptr) {
    sample_all<true>(field, to_field, points, rows, count, distance, gx, gy, gz);
  } else {
    sample_all<false>(field, to_field, points, rows, count, distance, gx, gy, gz);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sample_field_simd);

void sample_field(const FieldView& field, const Affine& to_field, const PointsView& points,
                  const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                  float* gy, float* gz) {
  HWY_DYNAMIC_DISPATCH(sample_field_simd)
  (field, to_field, points, rows, count, distance, gx, gy, gz);
}

}  // namespace h6::kernels
#endif
