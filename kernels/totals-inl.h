// SPDX-License-Identifier: Apache-2.0
// totals-inl.h - the sums of the lanes of many vectors of doubles, two vectors at a time.
//
// Included once for each SIMD target.
#include <cstddef>

// Per-target include guard.
#if defined(H6_KERNELS_TOTALS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_TOTALS_INL_H_
#undef H6_KERNELS_TOTALS_INL_H_
#else
#define H6_KERNELS_TOTALS_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
// Adds the halves of a vector until two lanes are left.
template <class D>
HWY_INLINE void store_two(D d, hn::Vec<D> both, double* to) {
  if constexpr (hn::MaxLanes(D()) > 2) {
    const hn::Half<D> half;
    store_two(half, hn::Add(hn::LowerHalf(half, both), hn::UpperHalf(half, both)), to);
  } else {
    hn::StoreU(both, d, to);
  }
}
#endif

// to[k] = the sum of the lanes of a, to[k + 1] that of b.
HWY_INLINE void total_two(hn::Vec<hn::ScalableTag<double>> a, hn::Vec<hn::ScalableTag<double>> b,
                          double* to) {
#if HWY_TARGET == HWY_SCALAR
  to[0] = hn::GetLane(a), to[1] = hn::GetLane(b);
#else
  const hn::ScalableTag<double> d;
  store_two(d, hn::Add(hn::InterleaveLower(d, a, b), hn::InterleaveUpper(d, a, b)), to);
#endif
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
