// SPDX-License-Identifier: Apache-2.0
// box_halves.cpp - the fast twin of box_halves_ref.cpp.
#include "kernels/bake/box_halves.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/box_halves.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most 3 x 16,000^2, so the sum of two fits.
HWY_INLINE std::int32_t squared_diagonal(const ShortBox* boxes, const std::uint16_t* some,
                                         std::size_t count) {
  const hn::CappedTag<std::int16_t, 8> d;
  alignas(16) std::int16_t least[8] = {};
  for (std::size_t part = 0; part < 8 && count > 0; part += hn::Lanes(d)) {
    auto low = hn::Load(d, boxes[some[0]].least + part), other = low;
    std::size_t i = 1;
    for (; i + 1 < count; i += 2) {
      low = hn::Min(low, hn::Load(d, boxes[some[i]].least + part));
      other = hn::Min(other, hn::Load(d, boxes[some[i + 1]].least + part));
    }
    if (i < count) low = hn::Min(low, hn::Load(d, boxes[some[i]].least + part));
    hn::Store(hn::Min(low, other), d, least + part);
  }
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t width = least[k] + least[4 + k];
    sum += width * width;
  }
  return sum;
}

std::size_t SmallestHalves(const ShortBox* boxes, const std::uint16_t* const* order,
                           std::size_t count, std::size_t half) {
  std::int32_t sum[3];
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] = squared_diagonal(boxes, order[k], half) +
             squared_diagonal(boxes, order[k] + half, count - half);
  std::size_t best = sum[1] < sum[0] ? 1 : 0;
  return sum[2] < sum[best] ? 2 : best;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(SmallestHalves);

std::size_t smallest_halves(const ShortBox* boxes, const std::uint16_t* const order[3],
                            std::size_t count, std::size_t half) {
  return HWY_DYNAMIC_DISPATCH(SmallestHalves)(boxes, order, count, half);
}

}  // namespace h6::kernels
#endif
