// SPDX-License-Identifier: Apache-2.0
// fold-inl.h - sums over the lanes of four vectors at once, in a fixed order, with a quarter of the
// shuffles that four separate sums take.
//
// Included once for each SIMD target.
#include <cstddef>

// Per-target include guard.
#if defined(H6_KERNELS_FOLD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_FOLD_INL_H_
#undef H6_KERNELS_FOLD_INL_H_
#else
#define H6_KERNELS_FOLD_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Adds the sums of four vectors' lanes to to[0..3].
template <class D>
HWY_INLINE void add_four_sums(D d, const hn::Vec<D>* sum, float* to) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t r = 0; r < 4; ++r) to[r] += hn::GetLane(hn::SumOfLanes(d, sum[r]));
#else
  const auto fold = [&](hn::Vec<D> a, hn::Vec<D> b) HWY_ATTR {
    return hn::Add(hn::InterleaveLower(d, a, b), hn::InterleaveUpper(d, a, b));
  };
  // Every block of four lanes now holds the four partial sums in order.
  const auto rows = fold(fold(sum[0], sum[2]), fold(sum[1], sum[3]));
  const hn::CappedTag<float, 4> d4;
  HWY_ALIGN float blocks[hn::MaxLanes(d)];
  hn::Store(rows, d, blocks);
  auto total = hn::Load(d4, blocks);
  for (std::size_t block = 4; block < hn::Lanes(d); block += 4)
    total = hn::Add(total, hn::Load(d4, blocks + block));
  hn::StoreU(hn::Add(total, hn::LoadU(d4, to)), d4, to);
#endif
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
