// touch_groups.cpp - the SIMD twin of touch_groups_ref.cpp.
#include "kernels/touch_groups.h"

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

std::size_t touch_groups_simd(const FieldView& field, const Affine& to_field,
                              const PointsView& points, const std::uint32_t* groups,
                              std::size_t count, float limit, const Touching& out, float* least) {
  const DF d;
  const DI di;
  static_assert(hn::MaxLanes(DF()) <= kGroup, "a vector is part of a group");
  const VF infinity = hn::Set(d, __builtin_huge_valf());
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
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

void make_contacts_simd(const ShellColumns& shell, const Touching& rows, std::size_t count,
                        const ContactFrame& frame, const ContactColumns& out) {
  const DF d;
  const DI di;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t live = count - i;  // load_n and store_n stop at a whole vector
    const VI row = load_n(di, reinterpret_cast<const std::int32_t*>(rows.row) + i, live);
    const VF x = hn::GatherIndex(d, shell.x, row), y = hn::GatherIndex(d, shell.y, row);
    const VF z = hn::GatherIndex(d, shell.z, row);
    store_n(hn::Add(rotated(frame.Ra, x, y, z), hn::Set(d, frame.arm[0])), d, out.rx + i, live);
    store_n(hn::Add(rotated(frame.Ra + 3, x, y, z), hn::Set(d, frame.arm[1])), d, out.ry + i, live);
    store_n(hn::Add(rotated(frame.Ra + 6, x, y, z), hn::Set(d, frame.arm[2])), d, out.rz + i, live);

    const VF mx = hn::GatherIndex(d, shell.nx, row), my = hn::GatherIndex(d, shell.ny, row);
    const VF mz = hn::GatherIndex(d, shell.nz, row);
    const VF nx = rotated(frame.Ra, mx, my, mz), ny = rotated(frame.Ra + 3, mx, my, mz);
    const VF nz = rotated(frame.Ra + 6, mx, my, mz);
    store_n(nx, d, out.nx + i, live);
    store_n(ny, d, out.ny + i, live);
    store_n(nz, d, out.nz + i, live);

    const VF ux = load_n(d, rows.gx + i, live), uy = load_n(d, rows.gy + i, live);
    const VF uz = load_n(d, rows.gz + i, live);
    const VF gx = rotated(frame.Rb, ux, uy, uz), gy = rotated(frame.Rb + 3, ux, uy, uz);
    const VF gz = rotated(frame.Rb + 6, ux, uy, uz);
    const VF length =
        hn::Sqrt(hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz))));
    const auto clear = hn::Gt(length, hn::Set(d, 1e-6f));
    store_n(hn::IfThenElse(clear, hn::Div(gx, length), nx), d, out.gx + i, live);
    store_n(hn::IfThenElse(clear, hn::Div(gy, length), ny), d, out.gy + i, live);
    store_n(hn::IfThenElse(clear, hn::Div(gz, length), nz), d, out.gz + i, live);

    const VF distance = load_n(d, rows.distance + i, live);
    store_n(hn::Mul(distance, hn::Set(d, -frame.voxel)), d, out.depth + i, live);
    store_n(hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(shell.point), row), di,
            reinterpret_cast<std::int32_t*>(out.point) + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(touch_groups_simd);
HWY_EXPORT(make_contacts_simd);

std::size_t touch_groups(const FieldView& field, const Affine& to_field, const PointsView& points,
                         const std::uint32_t* groups, std::size_t count, float limit,
                         const Touching& out, float* least) {
  return HWY_DYNAMIC_DISPATCH(touch_groups_simd)(field, to_field, points, groups, count, limit,
                                                 out, least);
}

void make_contacts(const ShellColumns& shell, const Touching& rows, std::size_t count,
                   const ContactFrame& frame, const ContactColumns& out) {
  HWY_DYNAMIC_DISPATCH(make_contacts_simd)(shell, rows, count, frame, out);
}

}  // namespace h6::kernels
#endif
