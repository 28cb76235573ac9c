// SPDX-License-Identifier: Apache-2.0
// sample_field.cpp - the SIMD twin of sample_field_ref.cpp.
//
// Cells with finer samples take longer. Where they are few in a vector, its other points do not
// wait for them: they are put aside and sampled together, a vector of them at a time.
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

// Points that were put aside: their places in the list of points.
struct Aside {
  std::size_t count = 0;
  std::uint32_t place[2 * hn::MaxLanes(DF())];
};

HWY_INLINE void put_aside(hn::Mask<DI> left_out, const Lanes& lanes, Aside& aside) {
  const DI di;
  HWY_ALIGN std::int32_t out[hn::MaxLanes(di)];
  hn::Store(hn::IfThenElseZero(left_out, hn::Set(di, 1)), di, out);
  for (std::size_t i = 0; i < lanes.live; ++i) {
    aside.place[aside.count] = static_cast<std::uint32_t>(lanes.first + i);
    aside.count += static_cast<std::size_t>(out[i]);
  }
}

template <bool kGradient>
HWY_INLINE void sample_lanes(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const Lanes& lanes, float* distance,
                             float* gx, float* gy, float* gz, Aside& aside) {
  const VI row = load_rows(lanes);
  const VF px = load_column(points.x, lanes, row);
  const VF py = load_column(points.y, lanes, row);
  const VF pz = load_column(points.z, lanes, row);
  VF value, dx, dy, dz;
  const auto left_out = sample_points<kGradient, true>(
      field, affine_row(to_field.m[0], px, py, pz), affine_row(to_field.m[1], px, py, pz),
      affine_row(to_field.m[2], px, py, pz), value, dx, dy, dz);
  store_n(value, DF(), distance + lanes.first, lanes.live);
  if (kGradient) {
    store_n(dx, DF(), gx + lanes.first, lanes.live);
    store_n(dy, DF(), gy + lanes.first, lanes.live);
    store_n(dz, DF(), gz + lanes.first, lanes.live);
  }
  if (HWY_UNLIKELY(!hn::AllFalse(DI(), left_out))) put_aside(left_out, lanes, aside);
}

// Samples the last points that were put aside, at most a vector of them.
template <bool kGradient>
HWY_NOINLINE void sample_aside(const FieldView& field, const Affine& to_field,
                               const PointsView& points, const std::uint32_t* rows, float* distance,
                               float* gx, float* gy, float* gz, Aside& aside) {
  const DF d;
  constexpr std::size_t kMost = hn::MaxLanes(DF());
  const std::size_t some = HWY_MIN(aside.count, hn::Lanes(d));
  aside.count -= some;
  const std::uint32_t* place = aside.place + aside.count;
  HWY_ALIGN float column[4][kMost] = {};
  for (std::size_t i = 0; i < some; ++i) {
    const std::size_t row = rows != nullptr ? rows[place[i]] : place[i];
    column[0][i] = points.x[row], column[1][i] = points.y[row], column[2][i] = points.z[row];
  }
  const VF px = hn::Load(d, column[0]), py = hn::Load(d, column[1]), pz = hn::Load(d, column[2]);
  VF value, dx, dy, dz;
  sample_points<kGradient>(field, affine_row(to_field.m[0], px, py, pz),
                           affine_row(to_field.m[1], px, py, pz),
                           affine_row(to_field.m[2], px, py, pz), value, dx, dy, dz);
  hn::Store(value, d, column[3]);
  for (std::size_t i = 0; i < some; ++i) distance[place[i]] = column[3][i];
  if (!kGradient) return;
  hn::Store(dx, d, column[0]), hn::Store(dy, d, column[1]), hn::Store(dz, d, column[2]);
  for (std::size_t i = 0; i < some; ++i)
    gx[place[i]] = column[0][i], gy[place[i]] = column[1][i], gz[place[i]] = column[2][i];
}

template <bool kGradient>
HWY_INLINE void sample_all(const FieldView& field, const Affine& to_field, const PointsView& points,
                           const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                           float* gy, float* gz) {
  const std::size_t width = hn::Lanes(DF());
  Aside aside;
  for (std::size_t k = 0; k < count; k += width) {
    const std::size_t live = HWY_MIN(width, count - k);
    sample_lanes<kGradient>(field, to_field, points, {rows, k, live}, distance, gx, gy, gz, aside);
    if (HWY_UNLIKELY(aside.count >= width))
      sample_aside<kGradient>(field, to_field, points, rows, distance, gx, gy, gz, aside);
  }
  if (aside.count > 0)
    sample_aside<kGradient>(field, to_field, points, rows, distance, gx, gy, gz, aside);
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
