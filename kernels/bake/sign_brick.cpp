// SPDX-License-Identifier: Apache-2.0
// sign_brick.cpp - the fast twin of sign_brick_ref: computes all cases and selects the one that
// holds.
#include "kernels/bake/sign_brick.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/sign_brick.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void SignBrickOf(const float* u, const BrickSides& sides, const SignLimits& limits, float* out) {
  const hn::CappedTag<float, 8> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Rebind<Chain, decltype(d)> d16;
  const std::size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d), offset = hn::Set(d, limits.offset);
  const auto voxel = hn::Set(d, limits.voxel), crooked = hn::Set(d, limits.crooked);
  const auto slack = hn::Set(d, limits.slack), corner = hn::Set(d, limits.corner_slack);
  const auto unit = hn::Set(d, kChainUnit), far = hn::Set(d, kChainFar * kChainUnit);
  const auto corrected = hn::Set(d32, sides.corrected ? 0xff : 0);
  alignas(64) static constexpr std::int32_t kBit[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  for (std::size_t n = 0; n < 512; n += lanes) {
    const auto bit = hn::Load(d32, kBit + n % 8);
    const auto at = [&](const std::uint64_t* mask) HWY_ATTR {
      return hn::Set(d32, std::int32_t(mask[n / 64] >> (n / 8 % 8 * 8) & 0xff));
    };
    const auto reached_bits = at(sides.reached), sight_bits = at(sides.in_sight);
    const auto reached = hn::RebindMask(d, hn::TestBit(reached_bits, bit));
    const auto in_sight = hn::RebindMask(d, hn::TestBit(sight_bits, bit));
    const auto away = hn::LoadU(d, u + n);
    const auto outside = hn::Sub(away, offset), sheet = hn::Add(away, offset);
    auto inside = hn::IfThenElse(in_sight, hn::Min(outside, zero), hn::Neg(sheet));
    if (sides.chain != nullptr) {
      const auto steps = hn::PromoteTo(d32, hn::LoadU(d16, sides.chain + n));
      const auto way = hn::Mul(hn::ConvertTo(d, steps), unit);
      const auto known = hn::Lt(way, far), before_sheet = hn::Lt(way, sheet);
      const auto dent =
          hn::Max(hn::Div(hn::Sub(way, slack), crooked), hn::Max(hn::Sub(offset, away), zero));
      const auto behind = hn::Max(hn::Div(hn::Sub(way, corner), crooked), sheet);
      inside =
          hn::IfThenElse(hn::And(known, hn::And(in_sight, before_sheet)), hn::Neg(dent), inside);
      const auto may = hn::RebindMask(d, hn::TestBit(hn::AndNot(sight_bits, corrected), bit));
      inside =
          hn::IfThenElse(hn::And(known, hn::AndNot(before_sheet, may)), hn::Neg(behind), inside);
    }
    hn::StoreU(hn::Mul(hn::IfThenElse(reached, outside, inside), voxel), d, out + n);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(SignBrickOf);

void sign_brick(const float* u, const BrickSides& sides, const SignLimits& limits, float* out) {
  HWY_DYNAMIC_DISPATCH(SignBrickOf)(u, sides, limits, out);
}

}  // namespace h6::kernels
#endif
