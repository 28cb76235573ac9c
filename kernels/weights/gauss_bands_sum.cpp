// SPDX-License-Identifier: Apache-2.0
// gauss_bands_sum.cpp - the sums of gauss_bands.h: hats over one sphere, item by item.
#include "kernels/weights/gauss_bands.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_bands_sum.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/weights/geodesic-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kBandBlock>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kParts = kBandBlock / kLanes;  // vectors that hold a block

// The number of hats that are summed before they are added to the total. Rounding then grows with
// the number of such sums, not with the number of hats.
constexpr std::size_t kFresh = 128;

// A block, a lane for each item.
struct Rows {
  VF x[3][kParts];
};
HWY_INLINE Rows load_rows(const GaussBands& g, std::size_t block) {
  Rows r;
  VF mass;
  for (std::size_t p = 0; p < kParts; ++p)
    hn::LoadInterleaved4(DF(), g.at + 4 * (block * kBandBlock + p * kLanes), r.x[0][p], r.x[1][p],
                         r.x[2][p], mass);
  return r;
}

struct Sum {
  VF phi[kParts];
};

// The hat of one contact at every lane.
template <bool kGeodesic>
HWY_INLINE VF hat_at(const Rows& rows, std::size_t p, VF width2, const float* at) {
  const DF d;
  const VF gx = hn::Sub(rows.x[0][p], hn::Set(d, at[0]));
  const VF gy = hn::Sub(rows.x[1][p], hn::Set(d, at[1]));
  const VF gz = hn::Sub(rows.x[2][p], hn::Set(d, at[2]));
  VF v = hn::NegMulAdd(gy, gy, hn::NegMulAdd(gx, gx, width2));
  v = hn::NegMulAdd(gz, gz, v);
  if constexpr (kGeodesic) return geodesic_hat(d, width2, v);
  return hn::Max(v, hn::Zero(d));
}

// Adds items first .. end - 1. Several sums run side by side, since an addition takes longer than a
// hat.
template <bool kGeodesic>
HWY_INLINE void add_contacts(const GaussBands& g, const Rows& rows, VF width2, std::size_t first,
                             std::size_t end, Sum& sum) {
  constexpr std::size_t kSums = 4;
  const DF d;
  while (first < end) {
    const std::size_t stop = HWY_MIN(first + kFresh, end);
    HWY_UNROLL(4)
    for (std::size_t p = 0; p < kParts; ++p) {
      VF fresh[kSums];
      for (VF& v : fresh) v = hn::Zero(d);
      const float* at = g.at + 4 * first;
      const float* const behind = g.at + 4 * stop;
      for (; at + 4 * kSums <= behind; at += 4 * kSums) {
        HWY_UNROLL(4)
        for (std::size_t k = 0; k < kSums; ++k)
          fresh[k] = hn::MulAdd(hn::Set(d, at[4 * k + 3]),
                                hat_at<kGeodesic>(rows, p, width2, at + 4 * k), fresh[k]);
      }
      for (; at < behind; at += 4)
        fresh[0] = hn::MulAdd(hn::Set(d, at[3]), hat_at<kGeodesic>(rows, p, width2, at), fresh[0]);
      const VF two[2] = {hn::Add(fresh[0], fresh[1]), hn::Add(fresh[2], fresh[3])};
      sum.phi[p] = hn::Add(sum.phi[p], hn::Add(two[0], two[1]));
    }
    first = stop;
  }
}

template <bool kGeodesic>
HWY_INLINE void sum_blocks(const GaussBands& g, std::size_t begin, std::size_t end) {
  const DF d;
  const VF width2 = hn::Set(d, g.width * g.width);
  const VF unit = hn::Set(d, 1 / (g.width * g.width));
  end = HWY_MIN(end, band_blocks(g.grid->count));
  for (std::size_t block = begin; block < end; ++block) {
    const Rows rows = load_rows(g, block);
    const BandRuns& runs = g.runs[block];
    Sum sum;
    for (VF& phi : sum.phi) phi = hn::Zero(d);
    for (std::uint32_t r = 0; r < runs.count; ++r)
      add_contacts<kGeodesic>(g, rows, width2, runs.first[r], runs.end[r], sum);
    for (std::size_t p = 0; p < kParts; ++p)
      hn::Store(hn::Mul(sum.phi[p], unit), d, g.phi + block * kBandBlock + p * kLanes);
  }
}

void sum_simd(const GaussBands& g, std::size_t begin, std::size_t end) {
  g.geodesic ? sum_blocks<true>(g, begin, end) : sum_blocks<false>(g, begin, end);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sum_simd);

void sum_bands(const GaussBands& g, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(sum_simd)(g, begin, end);
}

}  // namespace h6::kernels
#endif
