// touch_groups.cpp - the SIMD twin of touch_groups_ref.cpp.
#include "kernels/touch_groups.h"

#include <hwy/cache_control.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/touch_groups.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// So many groups before they are sampled their entries of the table are asked for, and half as many
// before their samples, which are found through those.
constexpr std::size_t kAhead = 16;

struct Ahead {
  HWY_ALIGN std::int32_t slot[kAhead][kGroup], node[kAhead][kGroup];
};

void ask_for_table(const FieldView& field, const Affine& to_field, const PointsView& points,
                   std::size_t group, std::size_t k, Ahead& ahead) {
  const DF d;
  const DI di;
  const VF zero = hn::Zero(d);
  std::int32_t* const slot = ahead.slot[k % kAhead];
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
    const std::size_t row = kGroup * group + i;
    const VF px = hn::LoadU(d, points.x + row), py = hn::LoadU(d, points.y + row);
    const VF pz = hn::LoadU(d, points.z + row);
    const auto axis = [&](int a) HWY_ATTR {
      const VF q = affine_row(to_field.m[a], px, py, pz);
      const VF last = hn::Set(d, static_cast<float>(8 * field.size[a] - 1));
      const VF inside = hn::Min(hn::Max(q, zero), last);
      // What is no number is sampled at the origin.
      return split_axis(hn::IfThenElseZero(hn::Eq(q, q), inside), field.size[a]);
    };
    const Axis x = axis(0), y = axis(1), z = axis(2);
    const Cell cell = cell_of(field, x, y, z);
    hn::Store(cell.slot, di, slot + i);
    hn::Store(cell.node, di, ahead.node[k % kAhead] + i);
  }
  for (std::size_t i = 0; i < kGroup; ++i) hwy::Prefetch(field.table + slot[i]);
}

void ask_for_samples(const FieldView& field, std::size_t k, const Ahead& ahead) {
  const std::int32_t* const slot = ahead.slot[k % kAhead];
  for (std::size_t i = 0; i < kGroup; ++i) {
    const std::int32_t entry = field.table[slot[i]];
    if (entry < 0) {
      hwy::Prefetch(field.far + 8 * (-1 - std::ptrdiff_t{entry}));
      continue;
    }
    const std::int16_t* const node =
        field.bricks + std::ptrdiff_t{entry} * kBrickStride + ahead.node[k % kAhead][i];
    hwy::Prefetch(node + 5);
    hwy::Prefetch(node + 86);
  }
}

std::size_t touch_groups_simd(const FieldView& field, const Affine& to_field,
                              const PointsView& points, const std::uint32_t* groups,
                              std::size_t count, float limit, bool cold, const Touching& out,
                              float* least) {
  const DF d;
  const DI di;
  static_assert(hn::MaxLanes(DF()) <= kGroup, "a vector is part of a group");
  const VF infinity = hn::Set(d, __builtin_huge_valf());
  std::size_t written = 0;
  Ahead ahead;
  if (cold) {
    for (std::size_t k = 0; k < HWY_MIN(count, kAhead); ++k)
      ask_for_table(field, to_field, points, groups[k], k, ahead);
    for (std::size_t k = 0; k < HWY_MIN(count, kAhead / 2); ++k) ask_for_samples(field, k, ahead);
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (cold) {
      // A slot of the ring is free when its group's samples were asked for.
      if (k + kAhead / 2 < count) ask_for_samples(field, k + kAhead / 2, ahead);
      if (k + kAhead < count)
        ask_for_table(field, to_field, points, groups[k + kAhead], k + kAhead, ahead);
    }
    VF smallest = infinity;
    for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
      const std::size_t row = kGroup * groups[k] + i;
      const VF px = hn::LoadU(d, points.x + row), py = hn::LoadU(d, points.y + row);
      const VF pz = hn::LoadU(d, points.z + row);
      VF distance, gx, gy, gz;
      sample_points<true>(field, affine_row(to_field.m[0], px, py, pz),
                          affine_row(to_field.m[1], px, py, pz),
                          affine_row(to_field.m[2], px, py, pz), distance, gx, gy, gz);
      if (HWY_UNLIKELY(row + hn::Lanes(d) > points.count)) {
        const std::size_t live = row < points.count ? points.count - row : 0;
        distance = hn::IfThenElse(hn::FirstN(d, live), distance, infinity);
      }
      smallest = hn::Min(smallest, distance);
      const auto touching = hn::Lt(distance, hn::Set(d, limit));
      const std::size_t n = hn::CountTrue(d, touching);
      if (n == 0) continue;
      const VI id = hn::Iota(di, static_cast<std::int32_t>(row));
      hn::StoreU(hn::Compress(id, hn::RebindMask(di, touching)), di,
                 reinterpret_cast<std::int32_t*>(out.row + written));
      hn::StoreU(hn::Compress(distance, touching), d, out.distance + written);
      hn::StoreU(hn::Compress(gx, touching), d, out.gx + written);
      hn::StoreU(hn::Compress(gy, touching), d, out.gy + written);
      hn::StoreU(hn::Compress(gz, touching), d, out.gz + written);
      written += n;
    }
    least[k] = hn::GetLane(hn::MinOfLanes(d, smallest));
  }
  return written;
}

HWY_INLINE VF rotated(const float* R, VF x, VF y, VF z) {
  const DF d;
  return hn::MulAdd(hn::Set(d, R[0]), x,
                    hn::MulAdd(hn::Set(d, R[1]), y, hn::Mul(hn::Set(d, R[2]), z)));
}

// Shell columns of `rows`, as they are: a gather costs more than reading whole vectors of a group
// and keeping what touches, where rows come in runs.
HWY_INLINE void pick_rows(const ShellColumns& shell, const std::uint32_t* rows, std::size_t count,
                          float* const* out, std::uint32_t* point) {
  const DF d;
  const DI di;
  constexpr std::int32_t kPlace = static_cast<std::int32_t>(hn::MaxLanes(DF())) - 1;
  const float* const columns[6] = {shell.x, shell.y, shell.z, shell.nx, shell.ny, shell.nz};
  for (std::size_t i = 0; i < count;) {
    const std::size_t live = count - i;
    const VI row = load_n(di, reinterpret_cast<const std::int32_t*>(rows) + i, live);
    const VI place = hn::And(row, hn::Set(di, kPlace));
    const std::uint32_t base = rows[i] & ~static_cast<std::uint32_t>(kPlace);
    const auto here = hn::Eq(hn::Sub(row, place), hn::Set(di, static_cast<std::int32_t>(base)));
    const auto index = hn::IndicesFromVec(d, place);
    for (int k = 0; k < 6; ++k)
      store_n(hn::TableLookupLanes(hn::LoadU(d, columns[k] + base), index), d, out[k] + i, live);
    const auto id = hn::LoadU(di, reinterpret_cast<const std::int32_t*>(shell.point) + base);
    store_n(hn::TableLookupLanes(id, hn::IndicesFromVec(di, place)), di,
            reinterpret_cast<std::int32_t*>(point) + i, live);
    // What was written past the run is written again.
    const auto end = hn::FindFirstTrue(di, hn::Not(here));
    i += end < 0 ? hn::Lanes(d) : static_cast<std::size_t>(end);
  }
}

void make_contacts_simd(const ShellColumns& shell, const Touching& rows, std::size_t count,
                        const ContactFrame& frame, const MadeContacts& out) {
  constexpr std::size_t kStage = 512;  // contacts that stay in the first cache
  const DF d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    if (i % kStage == 0) {
      float* const raw[6] = {out.rx + i, out.ry + i, out.rz + i,
                             out.nx + i, out.ny + i, out.nz + i};
      pick_rows(shell, rows.row + i, HWY_MIN(kStage, count - i), raw, out.point + i);
    }
    const std::size_t live = count - i;  // load_n and store_n stop at a whole vector
    const VF x = load_n(d, out.rx + i, live), y = load_n(d, out.ry + i, live);
    const VF z = load_n(d, out.rz + i, live);
    store_n(hn::Add(rotated(frame.Ra, x, y, z), hn::Set(d, frame.arm[0])), d, out.rx + i, live);
    store_n(hn::Add(rotated(frame.Ra + 3, x, y, z), hn::Set(d, frame.arm[1])), d, out.ry + i, live);
    store_n(hn::Add(rotated(frame.Ra + 6, x, y, z), hn::Set(d, frame.arm[2])), d, out.rz + i, live);

    const VF mx = load_n(d, out.nx + i, live), my = load_n(d, out.ny + i, live);
    const VF mz = load_n(d, out.nz + i, live);
    const VF nx = rotated(frame.Ra, mx, my, mz), ny = rotated(frame.Ra + 3, mx, my, mz);
    const VF nz = rotated(frame.Ra + 6, mx, my, mz);
    store_n(nx, d, out.nx + i, live);
    store_n(ny, d, out.ny + i, live);
    store_n(nz, d, out.nz + i, live);

    const VF ux = load_n(d, rows.gx + i, live), uy = load_n(d, rows.gy + i, live);
    const VF uz = load_n(d, rows.gz + i, live);
    const VF gx = rotated(frame.Rb, ux, uy, uz), gy = rotated(frame.Rb + 3, ux, uy, uz);
    const VF gz = rotated(frame.Rb + 6, ux, uy, uz);
    const VF length = hn::Sqrt(hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz))));
    const auto clear = hn::Gt(length, hn::Set(d, 1e-6f));
    const VF unit = hn::Div(hn::Set(d, 1.0f), length);
    store_n(hn::IfThenElse(clear, hn::Mul(gx, unit), nx), d, out.gx + i, live);
    store_n(hn::IfThenElse(clear, hn::Mul(gy, unit), ny), d, out.gy + i, live);
    store_n(hn::IfThenElse(clear, hn::Mul(gz, unit), nz), d, out.gz + i, live);

    const VF distance = load_n(d, rows.distance + i, live);
    store_n(hn::Mul(distance, hn::Set(d, -frame.voxel)), d, out.depth + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(touch_groups_simd);
HWY_EXPORT(make_contacts_simd);

std::size_t touch_groups(const FieldView& field, const Affine& to_field, const PointsView& points,
                         const std::uint32_t* groups, std::size_t count, float limit, bool cold,
                         const Touching& out, float* least) {
  return HWY_DYNAMIC_DISPATCH(touch_groups_simd)(field, to_field, points, groups, count, limit,
                                                 cold, out, least);
}

void make_contacts(const ShellColumns& shell, const Touching& rows, std::size_t count,
                   const ContactFrame& frame, const MadeContacts& out) {
  HWY_DYNAMIC_DISPATCH(make_contacts_simd)(shell, rows, count, frame, out);
}

}  // namespace h6::kernels
#endif
