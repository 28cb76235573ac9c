// SPDX-License-Identifier: Apache-2.0
// cull_spheres.cpp - the SIMD twin of cull_spheres_ref.cpp.
#include "kernels/contact/cull_spheres.h"

#include <hwy/cache_control.h>

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

// Rows that follow each other need no gathers.
HWY_INLINE bool is_run(const std::uint32_t* rows, std::size_t live) {
  const DI di;
  if (live < hn::Lanes(di)) return false;
  const auto first = static_cast<std::int32_t>(rows[0]);
  const VI run = hn::Add(hn::Iota(di, 0), hn::Set(di, first));
  return hn::AllTrue(di, hn::Eq(hn::LoadU(di, reinterpret_cast<const std::int32_t*>(rows)), run));
}

// Spheres in lanes k and up: columns where their rows are a run.
HWY_INLINE Lanes lanes_at(const std::uint32_t* rows, std::size_t k, std::size_t count) {
  const std::size_t live = HWY_MIN(hn::Lanes(DF()), count - k);
  if (rows != nullptr && is_run(rows + k, live)) return {nullptr, rows[k], live};
  return {rows, k, live};
}

// Prefetches what the spheres in lanes begin..end-1 sample: all their entries in the table, then
// all that these name. Without this each vector of spheres would wait twice for its memory.
constexpr std::size_t kChunk = 64;  // spheres
HWY_NOINLINE void prefetch_samples(const Culling& c, const std::uint32_t* rows, std::size_t begin,
                                   std::size_t end) {
  const DF d;
  const DI di;
  HWY_ALIGN std::int32_t slot[kChunk], node[kChunk];
  const std::int32_t slots = c.field.size[0] * c.field.size[1] * c.field.size[2];
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const Lanes lanes = lanes_at(rows, i, end);
    const VI row = load_rows(lanes);
    const VF px = load_column(c.spheres.x, lanes, row), py = load_column(c.spheres.y, lanes, row);
    const VF pz = load_column(c.spheres.z, lanes, row);
    Axis axis[3];
    for (int a = 0; a < 3; ++a) {
      const VF last = hn::Set(d, static_cast<float>(8 * c.field.size[a] - 1));
      const VF q = affine_row(c.to_field.m[a], px, py, pz);
      axis[a] = split_axis(hn::Min(hn::Max(q, hn::Zero(d)), last), c.field.size[a]);
    }
    const Cell cell = cell_of(c.field, axis[0], axis[1], axis[2]);
    // A NaN has any cell.
    const VI known = hn::Min(hn::Max(cell.slot, hn::Zero(di)), hn::Set(di, slots - 1));
    hn::Store(known, di, slot + (i - begin));
    hn::Store(cell.node, di, node + (i - begin));
    for (std::size_t k = i - begin; k < i - begin + hn::Lanes(d); ++k)
      hwy::Prefetch(c.field.table + slot[k]);
  }
  for (std::size_t k = 0; k < end - begin; ++k) {
    const std::int32_t entry = c.field.table[slot[k]];
    if (entry < 0) {
      hwy::Prefetch(c.field.far + 8 * (-1 - std::ptrdiff_t{entry}));
    } else {
      const std::int16_t* const brick =
          c.field.bricks + std::ptrdiff_t{row_of(entry)} * kBrickStride;
      hwy::Prefetch(brick + (node[k] + 5));
      hwy::Prefetch(brick + (node[k] + 86));
    }
  }
}
constexpr std::size_t kWorthPrefetching = 24;  // spheres
// From frame to frame the samples about so few spheres stay in the caches, even where a shell moves
// fast. With prefetches here and in touch_groups, frames of 50 to 430 contacts in clutter take 1.03
// to 1.19 times as long (frame/clutter, slide:0.5 and slide:2).
constexpr std::size_t kCachedSpheres = 1024;

std::size_t cull_spheres_simd(const FieldView& field, const Affine& to_field,
                              const SpheresView& spheres, float radius_scale, const Reach& reach,
                              float margin, const std::uint32_t* rows, std::uint32_t first,
                              std::size_t count, std::uint32_t* survivors, float* clearance,
                              bool cold) {
  // A run of rows is treated as columns that start at its first row.
  const std::size_t skip = rows == nullptr ? first : 0;
  const SpheresView from{spheres.x + skip, spheres.y + skip, spheres.z + skip,
                         spheres.radius + skip, spheres.count - skip};
  const Culling culling{field, to_field, from, radius_scale, reach, margin};
  const std::size_t width = hn::Lanes(DF());
  std::size_t written = 0;
  static_assert(kChunk % hn::MaxLanes(DF()) == 0, "a chunk is whole vectors");
  const bool prefetches = count >= (cold ? kWorthPrefetching : kCachedSpheres);
  for (std::size_t k = 0; k < count; k += width) {
    if (prefetches && k % kChunk == 0)
      prefetch_samples(culling, rows, k, HWY_MIN(k + kChunk, count));
    float* out = clearance != nullptr ? clearance + k : nullptr;
    const Lanes lanes = lanes_at(rows, k, count);
    const bool run = rows != nullptr && lanes.rows == nullptr;  // lanes.first is a row
    written += cull_lanes(culling, lanes, run ? 0 : first, survivors + written, out);
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
                         std::uint32_t* survivors, float* clearance, bool cold) {
  return HWY_DYNAMIC_DISPATCH(cull_spheres_simd)(field, to_field, spheres, radius_scale, reach,
                                                 margin, rows, first, count, survivors, clearance,
                                                 cold);
}

}  // namespace h6::kernels
#endif
