// SPDX-License-Identifier: Apache-2.0
// beside-inl.h - distance of points to a triangle within its plane.
//
// Included once for each SIMD target.
#include "kernels/bake/triangle_tables.h"

// Per-target include guard.
#if defined(H6_KERNELS_BESIDE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_BESIDE_INL_H_
#undef H6_KERNELS_BESIDE_INL_H_
#else
#define H6_KERNELS_BESIDE_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, kBlock>;
using VF = hn::Vec<D>;

// |p - triangle|^2 without the part h^2 across the plane, over the triangle's inside and its first
// edges.
template <int kEdges>
HWY_INLINE VF beside_squared(const DistanceFacet& f, const VF (&s)[3], const VF (&w)[3]) {
  const D d;
  const VF zero = hn::Zero(d);
  VF nearest = hn::Set(d, kNobodyNear);
  for (int e = 0; e < kEdges; ++e) {
    const VF beyond = hn::Max(hn::Sub(hn::Abs(s[e]), hn::Set(d, f.half[e])), zero);
    const VF squared = hn::MulAdd(beyond, beyond, hn::Mul(w[e], w[e]));
    nearest = e == 0 ? squared : hn::Min(nearest, squared);
  }
  const VF inner = hn::Min(hn::Min(w[0], w[1]), w[2]);
  return hn::IfThenZeroElse(hn::Ge(inner, hn::Set(d, f.inside_from)), nearest);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
