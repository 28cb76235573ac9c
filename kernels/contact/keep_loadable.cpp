// SPDX-License-Identifier: Apache-2.0
// keep_loadable.cpp - the SIMD twin of keep_loadable_ref.cpp.
#include "kernels/contact/keep_loadable.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/keep_loadable.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kBlock>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;

// The way v + w x r of lanes at r.
struct Way {
  VF q[3];
  HWY_INLINE Way(const float ahead[6], VF x, VF y, VF z) {
    q[0] = row(ahead[0], ahead[4], z, ahead[5], y);
    q[1] = row(ahead[1], ahead[5], x, ahead[3], z);
    q[2] = row(ahead[2], ahead[3], y, ahead[4], x);
  }
  HWY_INLINE VF along(VF x, VF y, VF z) const {
    return hn::Add(hn::Add(hn::Mul(x, q[0]), hn::Mul(y, q[1])), hn::Mul(z, q[2]));
  }

 private:
  // v + (a x - b y), as the reference groups it.
  static HWY_INLINE VF row(float v, float a, VF x, float b, VF y) {
    const DF d;
    return hn::Add(hn::Set(d, v), hn::Sub(hn::Mul(hn::Set(d, a), x), hn::Mul(hn::Set(d, b), y)));
  }
};

std::size_t keep_simd(const ShellColumns& shell, const Touching& rows, std::size_t count,
                      const float ahead[6]) {
  const DF d;
  const DI di;
  const std::size_t lanes = hn::Lanes(d);
  std::int32_t* const row = reinterpret_cast<std::int32_t*>(rows.row);
  float* const column[4] = {rows.distance, rows.gx, rows.gy, rows.gz};
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; i += lanes) {
    const std::size_t live = HWY_MIN(lanes, count - i);
    const auto r = load_n(di, row + i, live);
    VF v[4];
    for (int k = 0; k < 4; ++k) v[k] = load_n(d, column[k] + i, live);
    const auto all = hn::FirstN(d, live);
    auto keep = hn::And(hn::Lt(v[0], hn::Zero(d)), all);
    if (hn::CountTrue(d, keep) < live) {
      const auto at = [&](const float* from) HWY_ATTR { return hn::GatherIndex(d, from, r); };
      const Way way(ahead, at(shell.x), at(shell.y), at(shell.z));
      const VF towards = hn::Neg(way.along(at(shell.nx), at(shell.ny), at(shell.nz)));
      keep = hn::And(hn::Gt(hn::Max(hn::Zero(d), towards), v[0]), all);
    }
    const std::size_t found = hn::CountTrue(d, keep);
    if (found == 0) continue;
    // Rows up to i + live were read already, and kept <= i.
    store_n(compress(di, r, hn::RebindMask(di, keep)), di, row + kept, live);
    for (int k = 0; k < 4; ++k) store_n(compress(d, v[k], keep), d, column[k] + kept, live);
    kept += found;
  }
  return kept;
}

std::size_t groups_simd(const SpheresView& groups, const BundlesView& normals, const float ahead[6],
                        float most, const float* expiry, const float* now,
                        const std::uint32_t* blocks, std::size_t count, float* reach,
                        std::uint32_t* survivors) {
  const DF d;
  const DI di;
  const std::size_t lanes = hn::Lanes(d);
  const VF turn = hn::Set(d, std::hypot(ahead[3], ahead[4], ahead[5]));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < kBlock * count; k += lanes) {
    const std::size_t g = kBlock * blocks[k / kBlock] + k % kBlock;
    const auto at = [&](const float* column) HWY_ATTR { return hn::LoadU(d, column + g); };
    const Way way(ahead, at(groups.x), at(groups.y), at(groups.z));
    const VF towards = hn::Neg(way.along(at(normals.nx), at(normals.ny), at(normals.nz)));
    const VF size = hn::Sqrt(way.along(way.q[0], way.q[1], way.q[2]));
    const VF most_here = hn::Add(hn::Add(towards, hn::Mul(at(normals.spread), size)),
                                 hn::Mul(turn, at(groups.radius)));
    const VF here = hn::Min(hn::Set(d, most), hn::Max(hn::Zero(d), most_here));
    hn::StoreU(here, d, reach + g);
    const auto keep = hn::Le(at(expiry), hn::Add(hn::Set(d, now[g / kBlock]), here));
    const auto index = hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(g)));
    hn::StoreU(compress(di, index, hn::RebindMask(di, keep)), di,
               reinterpret_cast<std::int32_t*>(survivors) + kept);
    kept += hn::CountTrue(d, keep);
  }
  return kept;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(keep_simd);
HWY_EXPORT(groups_simd);

std::size_t keep_loadable(const ShellColumns& shell, const Touching& rows, std::size_t count,
                          const float ahead[6]) {
  return HWY_DYNAMIC_DISPATCH(keep_simd)(shell, rows, count, ahead);
}
std::size_t loadable_groups(const SpheresView& groups, const BundlesView& normals,
                            const float ahead[6], float most, const float* expiry, const float* now,
                            const std::uint32_t* blocks, std::size_t count, float* reach,
                            std::uint32_t* survivors) {
  return HWY_DYNAMIC_DISPATCH(groups_simd)(groups, normals, ahead, most, expiry, now, blocks, count,
                                           reach, survivors);
}

}  // namespace h6::kernels
#endif
