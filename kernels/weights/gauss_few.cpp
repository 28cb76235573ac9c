// SPDX-License-Identifier: Apache-2.0
// gauss_few.cpp - lanes over columns j, four rows i > j a pass: the hat of a pair joins the sum of
// its row, over lanes, and that of its column.
#include "kernels/weights/gauss_few.h"

#include "hapsix/base.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_few.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/fold-inl.h"
#include "kernels/tail-inl.h"
#include "kernels/weights/geodesic-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, 16>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kRows = 4;  // rows that share loads of columns

struct Few {
  const float* column[6];
  float width2[2];
  float ratio;  // Hat::sum: scales a hat over N, times its width squared, to the units of T
  HWY_ALIGN float share[kGaussFew + kLanes];
  HWY_ALIGN float sum[kGaussFew + kLanes];   // over columns that come before the row
  HWY_ALIGN float back[kGaussFew + kLanes];  // over rows that come after the column
};

// epsilon^2 - |V_j - V_i|^2, cut at 0, over one sphere; or with the angle.
template <bool kGeodesic>
HWY_INLINE VF hat_of(const Few& f, int sphere, const VF* x, std::size_t i) {
  const DF d;
  VF v = hn::Set(d, f.width2[sphere]);
  HWY_UNROLL(3)
  for (int k = 0; k < 3; ++k) {
    const VF gap = hn::Sub(x[k], hn::Set(d, f.column[3 * sphere + k][i]));
    v = hn::NegMulAdd(gap, gap, v);
  }
  if constexpr (kGeodesic) return geodesic_hat(d, hn::Set(d, f.width2[sphere]), v);
  return hn::Max(v, hn::Zero(d));
}

// Adds the pairs of rows i .. i + kCount - 1 with a vector of columns from j on; kLast: only with
// the columns before the row.
template <Hat kHat, bool kGeodesic, std::size_t kCount, bool kLast>
HWY_INLINE void add_tile(Few& f, std::size_t count, std::size_t i, std::size_t j, VF* sum) {
  const DF d;
  constexpr int kAxes = kHat == Hat::normal ? 3 : 6;
  const std::size_t live = kLast ? count - j : kLanes;
  VF x[kAxes];
  for (int k = 0; k < kAxes; ++k) x[k] = load_n(d, f.column[k] + j, live);
  const VF share = hn::Load(d, f.share + j);
  VF back = hn::Load(d, f.back + j);
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kCount; ++r) {
    VF hat = hat_of<kGeodesic>(f, 0, x, i + r);
    if constexpr (kHat == Hat::sum)
      hat = hn::MulAdd(hn::Set(d, f.ratio), hat, hat_of<kGeodesic>(f, 1, x + 3, i + r));
    if constexpr (kHat == Hat::product) hat = hn::Mul(hat, hat_of<kGeodesic>(f, 1, x + 3, i + r));
    if constexpr (kLast) hat = hn::IfThenElseZero(hn::FirstN(d, i + r > j ? i + r - j : 0), hat);
    sum[r] = hn::MulAdd(share, hat, sum[r]);
    back = hn::MulAdd(hn::Set(d, f.share[i + r]), hat, back);
  }
  hn::Store(back, d, f.back + j);
}

template <Hat kHat, bool kGeodesic, std::size_t kCount>
HWY_INLINE void add_rows(Few& f, std::size_t count, std::size_t i) {
  const DF d;
  VF sum[kRows];
  for (VF& v : sum) v = hn::Zero(d);
  std::size_t j = 0;
  for (; j + kLanes <= i; j += kLanes)
    add_tile<kHat, kGeodesic, kCount, false>(f, count, i, j, sum);
  for (; j < i + kCount - 1; j += kLanes)
    add_tile<kHat, kGeodesic, kCount, true>(f, count, i, j, sum);
  add_four_sums(d, sum, f.sum + i);
}

HWY_INLINE void set_shares(const DirectionsView& c, Few& f) {
  const DF d;
  VF most = hn::Zero(d);
  for (std::size_t j = 0; j < c.count; j += kLanes) {
    const std::size_t live = c.count - j;
    VF share = hn::IfThenElseZero(hn::FirstN(d, live), hn::Set(d, 1.0f));
    if (c.depth != nullptr) share = hn::Mul(share, load_n(d, c.depth + j, live));
    if (c.facing != nullptr) share = hn::Mul(share, load_n(d, c.facing + j, live));
    hn::Store(share, d, f.share + j);
    hn::Store(hn::Zero(d), d, f.sum + j);
    hn::Store(hn::Zero(d), d, f.back + j);
    most = hn::Max(most, share);
  }
  if (c.depth == nullptr && c.facing == nullptr) return;
  // Depths may be so small that their sum would be a denormal float.
  const float largest = hn::GetLane(hn::MaxOfLanes(d, most));
  const VF per_share = hn::Set(d, largest > 0 ? largest : 1.0f);
  for (std::size_t j = 0; j < c.count; j += kLanes)
    hn::Store(hn::Div(hn::Load(d, f.share + j), per_share), d, f.share + j);
}

template <Hat kHat, bool kGeodesic>
HWY_INLINE void weigh(const DirectionsView& c, const GaussWidths& widths, float* weight) {
  const DF d;
  Few f;  // not initialised: large
  const float* const columns[6] = {c.nx, c.ny, c.nz, c.tx, c.ty, c.tz};
  for (int k = 0; k < 6; ++k) f.column[k] = columns[k];
  const float n = HWY_MAX(widths.normal, kMinWidth), t = HWY_MAX(widths.torque, kMinWidth);
  f.width2[0] = n * n;
  f.width2[1] = t * t;
  f.ratio = f.width2[1] / f.width2[0];
  set_shares(c, f);
  std::size_t i = 0;
  for (; i + kRows <= c.count; i += kRows) add_rows<kHat, kGeodesic, kRows>(f, c.count, i);
  for (; i < c.count; ++i) add_rows<kHat, kGeodesic, 1>(f, c.count, i);

  const float unit = kHat == Hat::normal ? 1 / f.width2[0]
                     : kHat == Hat::sum  ? 1 / f.width2[1]
                                         : 1 / f.width2[0] / f.width2[1];
  const VF self = hn::Set(d, kHat == Hat::sum ? 2.0f : 1.0f), zero = hn::Zero(d);
  for (std::size_t j = 0; j < c.count; j += kLanes) {
    const std::size_t live = c.count - j;
    const VF own = hn::Mul(hn::Load(d, f.share + j), self);
    const VF others = hn::Add(hn::Load(d, f.sum + j), hn::Load(d, f.back + j));
    const VF phi = hn::MulAdd(others, hn::Set(d, unit), own);
    const VF facing = c.facing != nullptr ? load_n(d, c.facing + j, live) : hn::Set(d, 1.0f);
    const VF w = hn::Div(hn::Mul(facing, own), hn::Max(phi, own));
    store_n(hn::IfThenElseZero(hn::Gt(own, zero), w), d, weight + j, live);
  }
}

template <bool kGeodesic>
HWY_INLINE void weigh_by(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                         float* weight) {
  switch (hat) {
    case Hat::normal:
      return weigh<Hat::normal, kGeodesic>(c, widths, weight);
    case Hat::sum:
      return weigh<Hat::sum, kGeodesic>(c, widths, weight);
    case Hat::product:
      return weigh<Hat::product, kGeodesic>(c, widths, weight);
  }
}

void weigh_few(const DirectionsView& c, Hat hat, const GaussWidths& widths, float* weight) {
  widths.geodesic ? weigh_by<true>(c, hat, widths, weight)
                  : weigh_by<false>(c, hat, widths, weight);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(weigh_few);

void gauss_weights_few(const DirectionsView& c, Hat hat, const GaussWidths& widths, float* weight) {
  H6_ASSERT(c.count <= kGaussFew);
  HWY_DYNAMIC_DISPATCH(weigh_few)(c, hat, widths, weight);
}

}  // namespace h6::kernels
#endif
