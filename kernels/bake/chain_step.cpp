// SPDX-License-Identifier: Apache-2.0
// chain_step.cpp - the fast twin of chain_step_ref.
//
// A step goes along x, then y, then z. The lengths that a line of nodes, with its neighbours along
// x, offers to itself, to the lines beside it and to those diagonally across are computed once.
// Layers are done in order, and each is written as soon as the next has been read, so no copy is
// needed.
#include "kernels/bake/chain_step.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/chain_step.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Three layers of a brick: the lengths that they offer within the layer and along z.
struct Layers {
  alignas(64) Chain own[3][64], along[3][64];
};

// Calls f(y, lengths offered within the layer, lengths offered along z) for each line of a layer.
template <class D, class F>
HWY_INLINE void EachLine(D d, const Chain* from, std::ptrdiff_t line, F&& f) {
  using V = hn::Vec<D>;
  const V straight = hn::Set(d, Chain(kChainStep[1])), aside = hn::Set(d, Chain(kChainStep[2])),
          across = hn::Set(d, Chain(kChainStep[3]));
  struct Give {
    V own, beside, across;
  };
  const auto give = [&](const Chain* at) HWY_ATTR {
    const V own = hn::LoadU(d, at), side = hn::Min(hn::LoadU(d, at - 1), hn::LoadU(d, at + 1));
    return Give{hn::Min(own, hn::Add(side, straight)),
                hn::Min(hn::Add(own, straight), hn::Add(side, aside)),
                hn::Min(hn::Add(own, aside), hn::Add(side, across))};
  };
  Give before = give(from - line), here = give(from);
  for (std::ptrdiff_t y = 0; y < 8; ++y) {
    const Give after = give(from + (y + 1) * line);
    f(std::size_t(y), hn::Min(here.own, hn::Min(before.beside, after.beside)),
      hn::Min(here.beside, hn::Min(before.across, after.across)));
    before = here;
    here = after;
  }
}

bool ChainStepOf(const Chain* from, std::size_t line, std::size_t layer, Chain* to,
                 std::size_t to_line, std::size_t to_layer) {
  const hn::CappedTag<Chain, 8> d;
  const std::size_t lanes = hn::Lanes(d);
  Layers of;
  const auto far = hn::Set(d, kChainFar);
  auto changed = hn::Zero(d);
  for (std::size_t z = 0; z < 10; ++z) {  // layers 0 and 9 lie around the brick
    const Chain* in = from + z * layer - layer;
    Chain *own = of.own[z % 3], *along = of.along[z % 3];
    for (std::size_t x = 0; x < 8; x += lanes)
      EachLine(d, in + x, std::ptrdiff_t(line),
               [&](std::size_t y, auto line_own, auto line_along) HWY_ATTR {
                 hn::Store(line_own, d, own + 8 * y + x);
                 hn::Store(line_along, d, along + 8 * y + x);
               });
    if (z < 2) continue;
    const Chain *middle = of.own[(z - 1) % 3], *below = of.along[(z - 2) % 3];
    for (std::size_t n = 0; n < 64; n += lanes) {
      const std::size_t y = n / 8, x = n % 8;
      const auto least = hn::Min(hn::Min(far, hn::Load(d, middle + n)),
                                 hn::Min(hn::Load(d, below + n), hn::Load(d, along + n)));
      const auto old = hn::LoadU(d, in - layer + y * line + x);
      changed = hn::Or(changed, hn::Xor(least, old));
      hn::StoreU(least, d, to + (z - 2) * to_layer + y * to_line + x);
    }
  }
  return !hn::AllTrue(d, hn::Eq(changed, hn::Zero(d)));
}

void ChainSeedsOf(const float* u, const std::uint64_t* mask, const ChainSeeds& seeds, Chain* to,
                  std::size_t to_line, std::size_t to_layer) {
  const hn::CappedTag<float, 8> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Rebind<Chain, decltype(d)> d16;
  const std::size_t lanes = hn::Lanes(d);
  const auto scale = hn::Set(d, 1 / kChainUnit), level = hn::Set(d, seeds.level);
  const auto far = hn::Set(d32, kChainFar);
  alignas(64) static constexpr std::int32_t kBit[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  for (std::size_t z = 0; z < std::size_t(seeds.layers); ++z)
    for (std::size_t y = 0; y < std::size_t(seeds.lines); ++y) {
      Chain* line = to + z * to_layer + y * to_line;
      const auto bits = std::int32_t(mask[z] >> (8 * y) & 0xff);
      if (bits == 0 && !seeds.through) {
        std::fill_n(line, 8, kChainFar);
        continue;
      }
      for (std::size_t x = 0; x < 8; x += lanes) {
        const auto in = hn::TestBit(hn::Set(d32, bits), hn::Load(d32, kBit + x));
        const auto away = hn::LoadU(d, u + 64 * z + 8 * y + x);
        const auto signed_u = hn::IfThenElse(hn::RebindMask(d, in), away, hn::Neg(away));
        const auto length = hn::ConvertTo(d32, hn::Ceil(hn::Mul(hn::Sub(level, signed_u), scale)));
        const auto kept = seeds.through ? length : hn::IfThenElse(in, length, far);
        hn::StoreU(hn::DemoteTo(d16, kept), d16, line + x);
      }
    }
}

void ChainSidesOf(const Chain* chain, const float* u, const ChainLimits& limits, ChainSides& out) {
  const hn::CappedTag<float, 8> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Rebind<Chain, decltype(d)> d16;
  const std::size_t lanes = hn::Lanes(d);
  const auto unit = hn::Set(d, kChainUnit), far = hn::Set(d, kChainFar * kChainUnit);
  const auto offset = hn::Set(d, limits.offset), slack = hn::Set(d, limits.slack);
  const auto crooked = hn::Set(d, limits.crooked), close = hn::Set(d, limits.close);
  for (std::size_t z = 0; z < 8; ++z) {
    std::uint64_t words[3] = {0, 0, 0};
    for (std::size_t n = 0; n < 64; n += lanes) {
      const auto away = hn::LoadU(d, u + 64 * z + n);
      const auto steps = hn::PromoteTo(d32, hn::LoadU(d16, chain + 64 * z + n));
      const auto length = hn::Mul(hn::ConvertTo(d, steps), unit);
      const auto known = hn::Lt(length, far);
      const auto short_of = hn::Lt(length, hn::Add(away, offset));
      const auto in_sight = hn::And(known, short_of);
      const auto dent = hn::Div(hn::Sub(length, slack), crooked);
      const auto deeper = hn::Gt(dent, hn::Max(hn::Sub(offset, away), hn::Zero(d)));
      const auto near = hn::AndNot(short_of, hn::And(known, hn::Le(away, close)));
      std::uint8_t bits[3][8] = {};
      hn::StoreMaskBits(d, in_sight, bits[0]);
      hn::StoreMaskBits(d, hn::And(in_sight, deeper), bits[1]);
      hn::StoreMaskBits(d, near, bits[2]);
      for (std::size_t k = 0; k < 3; ++k) words[k] |= std::uint64_t{bits[k][0]} << n;
    }
    out.in_sight[z] = words[0];
    out.dented[z] = words[1];
    out.close[z] = words[2];
  }
}

void ChainNearestOf(const Chain* from, std::size_t line, std::size_t layer,
                    const std::uint64_t* mask, std::uint8_t* nearest) {
  const hn::CappedTag<Chain, 8> d;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const std::size_t lanes = hn::Lanes(d);
  const auto one = hn::Set(d, Chain{1});
  for (std::size_t n = 0; n < 512; n += lanes) {
    if ((mask[n / 64] >> (n / 8 % 8 * 8) & 0xff) == 0) continue;
    const Chain* at = from + n / 64 * layer + n / 8 % 8 * line + n % 8;
    auto least = hn::Set(d, kChainFar), who = hn::Set(d, Chain{13}), i = hn::Zero(d);
    for (std::ptrdiff_t z = -1; z <= 1; ++z)
      for (std::ptrdiff_t y = -1; y <= 1; ++y) {
        const int apart = (y != 0) + (z != 0);
        const Chain* beside = at + z * std::ptrdiff_t(layer) + y * std::ptrdiff_t(line);
        const auto straight = hn::Set(d, Chain(kChainStep[apart])),
                   aside = hn::Set(d, Chain(kChainStep[apart + 1]));
        const auto weigh = [&](auto way) HWY_ATTR {
          who = hn::IfThenElse(hn::Lt(way, least), i, who);
          least = hn::Min(least, way);
          i = hn::Add(i, one);
        };
        weigh(hn::Add(hn::LoadU(d, beside - 1), aside));
        if (apart != 0)
          weigh(hn::Add(hn::LoadU(d, beside), straight));
        else
          i = hn::Add(i, one);
        weigh(hn::Add(hn::LoadU(d, beside + 1), aside));
      }
    hn::StoreU(hn::DemoteTo(d8, who), d8, nearest + n);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(ChainStepOf);
HWY_EXPORT(ChainSeedsOf);
HWY_EXPORT(ChainSidesOf);
HWY_EXPORT(ChainNearestOf);

bool chain_step(const Chain* from, std::size_t line, std::size_t layer, Chain* to,
                std::size_t to_line, std::size_t to_layer) {
  return HWY_DYNAMIC_DISPATCH(ChainStepOf)(from, line, layer, to, to_line, to_layer);
}

void chain_seeds(const float* u, const std::uint64_t* mask, const ChainSeeds& seeds, Chain* to,
                 std::size_t to_line, std::size_t to_layer) {
  HWY_DYNAMIC_DISPATCH(ChainSeedsOf)(u, mask, seeds, to, to_line, to_layer);
}

void chain_sides(const Chain* chain, const float* u, const ChainLimits& limits, ChainSides& out) {
  HWY_DYNAMIC_DISPATCH(ChainSidesOf)(chain, u, limits, out);
}

void chain_nearest(const Chain* from, std::size_t line, std::size_t layer,
                   const std::uint64_t* mask, std::uint8_t* nearest) {
  HWY_DYNAMIC_DISPATCH(ChainNearestOf)(from, line, layer, mask, nearest);
}

}  // namespace h6::kernels
#endif
