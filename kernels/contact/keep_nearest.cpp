// SPDX-License-Identifier: Apache-2.0
// keep_nearest.cpp - the fast twin of keep_nearest_ref.
//
// The limit is found by bisection: each step counts the values below the middle, a vector at a
// time. For some ten thousand values these 32 passes cost less than a selection that moves them.
#include "kernels/contact/keep_nearest.h"

#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/keep_nearest.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>
#include "kernels/compress-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
using DF = hn::CappedTag<float, 16>;
using DU = hn::RebindToUnsigned<DF>;
using VF = hn::Vec<DF>;

// Maps floats to unsigned integers of the same order, so that bisection takes 32 steps.
HWY_INLINE float float_of(std::uint32_t key) {
  return std::bit_cast<float>(key >> 31 ? key ^ 0x80000000u : ~key);
}
HWY_INLINE std::uint32_t key_of(float v) {
  const auto bits = std::bit_cast<std::uint32_t>(v + 0.0f);  // no -0
  return bits >> 31 ? ~bits : bits ^ 0x80000000u;
}

HWY_INLINE std::size_t count_below(const float* v, std::size_t count, float level) {
  const DF d;
  const DU du;
  const VF limit = hn::Set(d, level);
  const auto one = hn::Set(du, 1);
  auto sum = hn::Zero(du), other = hn::Zero(du);  // two independent chains of additions
  const std::size_t lanes = hn::Lanes(d);
  const auto below = [&](VF x) HWY_ATTR {
    return hn::IfThenElseZero(hn::RebindMask(du, hn::Lt(x, limit)), one);
  };
  std::size_t i = 0;
  for (; i + 2 * lanes <= count; i += 2 * lanes) {
    sum = hn::Add(sum, below(hn::LoadU(d, v + i)));
    other = hn::Add(other, below(hn::LoadU(d, v + i + lanes)));
  }
  std::size_t rest = 0;
  for (; i < count; ++i) rest += v[i] < level;
  return rest + hn::GetLane(hn::SumOfLanes(du, hn::Add(sum, other)));
}

NearestLimit LimitOf(const float* distance, std::size_t count, std::size_t k) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  float low = distance[0], high = distance[0];
  VF least = hn::Set(d, low), most = least;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const VF v = hn::LoadU(d, distance + i);
    least = hn::Min(least, v), most = hn::Max(most, v);
  }
  low = hn::GetLane(hn::MinOfLanes(d, least)), high = hn::GetLane(hn::MaxOfLanes(d, most));
  for (; i < count; ++i) low = HWY_MIN(low, distance[i]), high = HWY_MAX(high, distance[i]);
  // The k-th value is the greatest number with fewer than k values below it.
  std::uint32_t yes = key_of(low), no = key_of(high) + 1;
  std::size_t below = 0;
  while (no - yes > 1) {
    const std::uint32_t middle = yes + (no - yes) / 2;
    const std::size_t fewer = count_below(distance, count, float_of(middle));
    if (fewer < k)
      yes = middle, below = fewer;
    else
      no = middle;
  }
  return {float_of(yes), below};
}

std::size_t KeepRows(const Touching& p, float* key, std::size_t begin, std::size_t end, float limit,
                     std::size_t& ties, std::size_t to) {
  const DF d;
  const DU du;
  const std::size_t lanes = hn::Lanes(d), first = to;
  const VF at = hn::Set(d, limit);
  std::size_t i = begin;
  for (; i + lanes <= end; i += lanes) {
    const VF v = hn::LoadU(d, key + i);
    auto keep = hn::Lt(v, at);
    const auto equal = hn::Eq(v, at);
    if (HWY_UNLIKELY(!hn::AllFalse(d, equal))) {
      const std::size_t here = hn::CountTrue(d, equal);
      if (here > ties) break;  // one by one from here on
      ties -= here;
      keep = hn::Or(keep, equal);
    }
    // A whole vector is stored, over rows that were read already: to <= i.
    const auto row = hn::LoadU(du, p.row + i);
    const VF distance = hn::LoadU(d, p.distance + i);
    const VF x = hn::LoadU(d, p.gx + i), y = hn::LoadU(d, p.gy + i), z = hn::LoadU(d, p.gz + i);
    hn::StoreU(compress(d, v, keep), d, key + to);
    hn::StoreU(compress(d, distance, keep), d, p.distance + to);
    hn::StoreU(compress(du, row, hn::RebindMask(du, keep)), du, p.row + to);
    hn::StoreU(compress(d, x, keep), d, p.gx + to);
    hn::StoreU(compress(d, y, keep), d, p.gy + to);
    hn::StoreU(compress(d, z, keep), d, p.gz + to);
    to += hn::CountTrue(d, keep);
  }
  return to - first + keep_nearest_ref(p, key, i, end, limit, ties, to);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(LimitOf);
HWY_EXPORT(KeepRows);

NearestLimit nearest_limit(const float* distance, std::size_t count, std::size_t k) {
  return HWY_DYNAMIC_DISPATCH(LimitOf)(distance, count, k);
}
std::size_t keep_nearest(const Touching& points, float* key, std::size_t begin, std::size_t end,
                         float limit, std::size_t& ties, std::size_t to) {
  return HWY_DYNAMIC_DISPATCH(KeepRows)(points, key, begin, end, limit, ties, to);
}

}  // namespace h6::kernels
#endif
