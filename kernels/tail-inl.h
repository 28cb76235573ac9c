// SPDX-License-Identifier: Apache-2.0
// tail-inl.h - loads and stores of the first n lanes that touch no memory past them.
//
// Included once for each SIMD target. Where the instruction set has no masked access (SSE), Highway
// reads or writes a whole vector, which can fault at the end of a page, and a masked load of one
// lane reads it always. A buffer is used there.
#include <cstddef>
#include <cstring>

// Per-target include guard.
#if defined(H6_KERNELS_TAIL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_TAIL_INL_H_
#undef H6_KERNELS_TAIL_INL_H_
#else
#define H6_KERNELS_TAIL_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Lanes n and up are 0. With n at or above the width a whole vector is loaded.
template <class D, class T = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> load_n(D d, const T* p, std::size_t n) {
  if (HWY_LIKELY(n >= hn::Lanes(d))) return hn::LoadU(d, p);
#if HWY_MEM_OPS_MIGHT_FAULT || HWY_TARGET == HWY_SCALAR
  HWY_ALIGN T lanes[hn::MaxLanes(d)] = {};
  std::memcpy(lanes, p, n * sizeof(T));
  return hn::Load(d, lanes);
#else
  return hn::MaskedLoad(hn::FirstN(d, n), d, p);
#endif
}

template <class D, class T = hn::TFromD<D>>
HWY_INLINE void store_n(hn::Vec<D> v, D d, T* p, std::size_t n) {
  if (HWY_LIKELY(n >= hn::Lanes(d))) return hn::StoreU(v, d, p);
#if HWY_MEM_OPS_MIGHT_FAULT
  HWY_ALIGN T lanes[hn::MaxLanes(d)];
  hn::Store(v, d, lanes);
  std::memcpy(p, lanes, n * sizeof(T));
#else
  hn::BlendedStore(v, hn::FirstN(d, n), d, p);
#endif
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
