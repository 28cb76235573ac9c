// SPDX-License-Identifier: Apache-2.0
// geodesic-inl.h - the hat of GaussWidths::geodesic.
//
// Included once for each SIMD target.

// Per-target include guard.
#if defined(H6_KERNELS_GEODESIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_GEODESIC_INL_H_
#undef H6_KERNELS_GEODESIC_INL_H_
#else
#define H6_KERNELS_GEODESIC_INL_H_
#endif

#include "hwy/highway.h"
// After highway.h.
#include "hwy/contrib/math/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// epsilon^2 - angle^2, cut at 0, from epsilon^2 - chord^2. An angle is never smaller than its
// chord, so a contact within epsilon by the angle is also within epsilon by the chord.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V geodesic_hat(D d, V width2, V below_edge) {
  const V chord2 = hn::Max(hn::Sub(width2, below_edge), hn::Zero(d));
  const V half = hn::Mul(hn::Sqrt(chord2), hn::Set(d, 0.5f));
  const V half_angle = hn::Asin(d, hn::Min(half, hn::Set(d, 1.0f)));
  const V v = hn::NegMulAdd(hn::Mul(half_angle, half_angle), hn::Set(d, 4.0f), width2);
  return hn::Max(v, hn::Zero(d));
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
