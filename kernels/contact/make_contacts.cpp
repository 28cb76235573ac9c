// SPDX-License-Identifier: Apache-2.0
// make_contacts.cpp - the SIMD twin of make_contacts_ref, a vector of contacts at a time.
#include "kernels/contact/touch_groups.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/make_contacts.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

template <class M>
HWY_INLINE std::uint32_t bits_of(M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DI(), mask, bytes);
  return bytes[0] | bytes[1] << 8;
}

HWY_INLINE VF rotated(const float* R, VF x, VF y, VF z) {
  const DF d;
  return hn::MulAdd(hn::Set(d, R[0]), x,
                    hn::MulAdd(hn::Set(d, R[1]), y, hn::Mul(hn::Set(d, R[2]), z)));
}

struct PickedRows {
  VF v[6];  // x, y, z, nx, ny, nz
  VI point;
};

// Shell columns at a vector of rows. Rows come in runs, and there reading whole vectors of the
// shell and permuting them costs less than a gather. Lanes from `live` on are unspecified.
HWY_INLINE PickedRows pick_rows(const ShellColumns& shell, const std::uint32_t* rows,
                                std::size_t live) {
  const DF d;
  const DI di;
  constexpr std::int32_t kPlace = static_cast<std::int32_t>(hn::MaxLanes(DF())) - 1;
  const float* const columns[6] = {shell.x, shell.y, shell.z, shell.nx, shell.ny, shell.nz};
  const VI row = load_n(di, reinterpret_cast<const std::int32_t*>(rows), live);
  const VI place = hn::And(row, hn::Set(di, kPlace)), base = hn::Sub(row, place);
  const auto index = hn::IndicesFromVec(d, place);
  const auto id_index = hn::IndicesFromVec(di, place);
  // A run begins where the base differs from that of the lane before.
  const VI before = hn::Max(hn::Sub(hn::Iota(di, 0), hn::Set(di, 1)), hn::Zero(di));
  const auto begins = hn::Or(
      hn::FirstN(di, 1), hn::Ne(base, hn::TableLookupLanes(base, hn::IndicesFromVec(di, before))));
  std::uint32_t left = bits_of(hn::And(begins, hn::FirstN(di, live)));
  PickedRows picked;
  for (VF& v : picked.v) v = hn::Zero(d);
  picked.point = hn::Zero(di);
  for (; left != 0; left &= left - 1) {
    const std::uint32_t first =
        rows[hwy::Num0BitsBelowLS1Bit_Nonzero32(left)] & ~static_cast<std::uint32_t>(kPlace);
    const auto here = hn::Eq(base, hn::Set(di, static_cast<std::int32_t>(first)));
    const auto mine = hn::RebindMask(d, here);
    HWY_UNROLL(6)
    for (int k = 0; k < 6; ++k) {
      const VF v = hn::TableLookupLanes(hn::LoadU(d, columns[k] + first), index);
      picked.v[k] = hn::IfThenElse(mine, v, picked.v[k]);
    }
    const VI id = hn::LoadU(di, reinterpret_cast<const std::int32_t*>(shell.point) + first);
    picked.point = hn::IfThenElse(here, hn::TableLookupLanes(id, id_index), picked.point);
  }
  return picked;
}

void make_contacts_simd(const ShellColumns& shell, const Touching& rows, std::size_t count,
                        const ContactFrame& frame, const MadeContacts& out) {
  const DF d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t live = count - i;  // load_n and store_n stop at a whole vector
    const PickedRows own = pick_rows(shell, rows.row + i, live);
    store_n(own.point, DI(), reinterpret_cast<std::int32_t*>(out.point) + i, live);
    const VF x = own.v[0], y = own.v[1], z = own.v[2];
    store_n(hn::Add(rotated(frame.Ra, x, y, z), hn::Set(d, frame.arm[0])), d, out.rx + i, live);
    store_n(hn::Add(rotated(frame.Ra + 3, x, y, z), hn::Set(d, frame.arm[1])), d, out.ry + i, live);
    store_n(hn::Add(rotated(frame.Ra + 6, x, y, z), hn::Set(d, frame.arm[2])), d, out.rz + i, live);

    const VF mx = own.v[3], my = own.v[4], mz = own.v[5];
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

HWY_EXPORT(make_contacts_simd);

void make_contacts(const ShellColumns& shell, const Touching& rows, std::size_t count,
                   const ContactFrame& frame, const MadeContacts& out) {
  HWY_DYNAMIC_DISPATCH(make_contacts_simd)(shell, rows, count, frame, out);
}

}  // namespace h6::kernels
#endif
