// SPDX-License-Identifier: Apache-2.0
// cull_spheres.cpp - the SIMD twin of cull_spheres_ref.cpp.
#include "kernels/contact/cull_spheres.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/cull_spheres.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// cull_reach of every lane.
HWY_INLINE VF reach_of(VF s, const Reach& r) {
  const DF d;
  const VF long_form = hn::Add(s, hn::Set(d, r.error));
  const VF short_form = hn::Mul(s, hn::Set(d, r.slope));
  const auto near = hn::Lt(s, hn::Set(d, r.below));
  const VF reach = hn::Add(hn::IfThenElse(near, short_form, long_form), hn::Set(d, kReachRounding));
  return hn::IfThenElseZero(hn::Gt(s, hn::Zero(d)), reach);
}

// cull_clearance of every lane.
HWY_INLINE VF clearance_of(VF distance, const Reach& r) {
  const DF d;
  const VF left = hn::Sub(distance, hn::Set(d, kReachRounding));
  const VF long_form = hn::Sub(left, hn::Set(d, r.error));
  if (!(r.below > 0)) return long_form;
  const VF short_form = hn::Mul(left, hn::Set(d, 1.0f / r.slope));
  const VF edge = hn::Set(d, r.below);
  const VF far_form =
      hn::IfThenElse(hn::Gt(long_form, edge), long_form, hn::Set(d, r.below - 1e-4f));
  return hn::IfThenElse(hn::Lt(short_form, edge), short_form, far_form);
}

struct Culling {
  const FieldView& field;
  const Affine& to_field;
  const SpheresView& spheres;
  float radius_scale;
  const Reach& reach;
  float margin;
};

// Appends the survivors among `lanes` and returns their number. Storing a whole vector is safe: at
// most `first` survivors were written before, so it ends within the rows already read.
HWY_INLINE std::size_t cull_lanes(const Culling& c, const Lanes& lanes, std::uint32_t first,
                                  std::uint32_t* survivors, float* clearance) {
  const DF d;
  const DI di;
  const VI row = load_rows(lanes);
  const VF px = load_column(c.spheres.x, lanes, row);
  const VF py = load_column(c.spheres.y, lanes, row);
  const VF pz = load_column(c.spheres.z, lanes, row);
  const VF radius = load_column(c.spheres.radius, lanes, row);
  VF distance, gx, gy, gz;
  sample_points<false>(c.field, affine_row(c.to_field.m[0], px, py, pz),
                       affine_row(c.to_field.m[1], px, py, pz),
                       affine_row(c.to_field.m[2], px, py, pz), distance, gx, gy, gz);

  const VF scaled = hn::Mul(radius, hn::Set(d, c.radius_scale));
  const VF reach = reach_of(scaled, c.reach);
  const auto live = hn::FirstN(d, lanes.live);
  const auto keep = hn::And(live, hn::Le(distance, hn::Add(reach, hn::Set(d, c.margin))));
  const std::size_t kept = hn::CountTrue(d, keep);
  if (clearance != nullptr) {
    const VF left = hn::Sub(clearance_of(distance, c.reach), scaled);
    const auto held = hn::And(keep, hn::Gt(left, hn::Zero(d)));
    store_n(hn::IfThenElse(held, hn::Zero(d), left), d, clearance, lanes.live);
  }
  if (kept == 0) return 0;

  const VI id =
      lanes.rows != nullptr
          ? row
          : hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(first + lanes.first)));
  const VI ids = compress(di, id, hn::RebindMask(di, keep));
  const bool whole = lanes.live >= hn::Lanes(d);
  store_n(ids, di, reinterpret_cast<std::int32_t*>(survivors), whole ? lanes.live : kept);
  return kept;
}

std::size_t cull_spheres_simd(const FieldView& field, const Affine& to_field,
                              const SpheresView& spheres, float radius_scale, const Reach& reach,
                              float margin, const std::uint32_t* rows, std::uint32_t first,
                              std::size_t count, std::uint32_t* survivors, float* clearance) {
  // A run of rows is treated as columns that start at its first row.
  const std::size_t skip = rows == nullptr ? first : 0;
  const SpheresView from{spheres.x + skip, spheres.y + skip, spheres.z + skip,
                         spheres.radius + skip, spheres.count - skip};
  const Culling culling{field, to_field, from, radius_scale, reach, margin};
  const std::size_t width = hn::Lanes(DF());
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; k += width) {
    const std::size_t live = HWY_MIN(width, count - k);
    float* out = clearance != nullptr ? clearance + k : nullptr;
    written += cull_lanes(culling, {rows, k, live}, first, survivors + written, out);
  }
  return written;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(cull_spheres_simd);

std::size_t cull_spheres(const FieldView& field, const Affine& to_field, const SpheresView& spheres,
                         float radius_scale, const Reach& reach, float margin,
                         const std::uint32_t* rows, std::uint32_t first, std::size_t count,
                         std::uint32_t* survivors, float* clearance) {
  return HWY_DYNAMIC_DISPATCH(cull_spheres_simd)(field, to_field, spheres, radius_scale, reach,
                                                 margin, rows, first, count, survivors, clearance);
}

}  // namespace h6::kernels
#endif
