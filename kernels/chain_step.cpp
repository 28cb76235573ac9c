// chain_step.cpp - the fast twin of chain_step_ref.
//
// The padded brick is read as one flat array, whatever a vector's length: first what every place
// gives to its own line, to the four lines beside it and to the four across, neighbours along x
// included; then each place takes the least of nine. Places outside the brick are computed and
// dropped.
#include "kernels/chain_step.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/chain_step.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kLine = 16, kLayer = 10 * kLine, kAll = 10 * kLayer, kPad = 64;

// Places of a line that are nodes of the brick, 16 after 16.
struct InLine {
  alignas(64) Chain v[32 + 16];
};
constexpr InLine in_line() {
  InLine in{};
  for (std::size_t i = 0; i < 48; ++i) in.v[i] = i % 16 >= 1 && i % 16 <= 8 ? 1 : 0;
  return in;
}
constexpr InLine kInLine = in_line();

void ChainSteps(const ChainBrick& brick, int steps, Chain* out) {
  const hn::CappedTag<Chain, 32> d;
  const std::size_t lanes = hn::Lanes(d);
  alignas(64) Chain from[kPad + kAll + kPad], give[3][kAll + kPad];
  std::copy_n(&brick.v[0][0][0], kAll, from + kPad);
  from[kPad - 1] = from[kPad + kAll] = kChainFar;
  const auto straight = hn::Set(d, Chain(kChainStep[1])), aside = hn::Set(d, Chain(kChainStep[2])),
             across = hn::Set(d, Chain(kChainStep[3]));
  const auto far = hn::Set(d, kChainFar), zero = hn::Zero(d);
  for (int step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < kAll; i += lanes) {
      const auto own = hn::Load(d, from + kPad + i);
      const auto side =
          hn::Min(hn::LoadU(d, from + kPad + i - 1), hn::LoadU(d, from + kPad + i + 1));
      hn::Store(hn::Min(own, hn::Add(side, straight)), d, give[0] + i);
      hn::Store(hn::Min(hn::Add(own, straight), hn::Add(side, aside)), d, give[1] + i);
      hn::Store(hn::Min(hn::Add(own, aside), hn::Add(side, across)), d, give[2] + i);
    }
    auto changed = zero;
    for (std::size_t z = 0; z < 8; ++z) {
      const std::size_t first = (z + 1) * kLayer + kLine;
      for (std::size_t i = 0; i < 8 * kLine; i += lanes) {
        const std::size_t at = first + i;
        const auto get = [&](std::size_t k, std::size_t where)
                             HWY_ATTR { return hn::LoadU(d, give[k] + where); };
        auto least = hn::Min(far, get(0, at));
        least = hn::Min(least, hn::Min(get(1, at - kLayer), get(1, at + kLayer)));
        least = hn::Min(least, hn::Min(get(1, at - kLine), get(1, at + kLine)));
        least = hn::Min(least, hn::Min(get(2, at - kLayer - kLine), get(2, at - kLayer + kLine)));
        least = hn::Min(least, hn::Min(get(2, at + kLayer - kLine), get(2, at + kLayer + kLine)));
        const auto old = hn::LoadU(d, from + kPad + at);
        const auto inside = hn::Ne(hn::LoadU(d, kInLine.v + i % 16), zero);
        const auto now = hn::IfThenElse(inside, least, old);
        changed = hn::Or(changed, hn::Xor(now, old));
        hn::StoreU(now, d, from + kPad + at);
      }
    }
    if (hn::AllTrue(d, hn::Eq(changed, zero))) break;
  }
  for (std::size_t line = 0; line < 64; ++line)
    std::copy_n(from + kPad + (line / 8 + 1) * kLayer + (line % 8 + 1) * kLine + 1, 8,
                out + 8 * line);
}

void ChainSeeds(const float* u, std::size_t u_apart, const std::uint8_t* mask, std::size_t lines,
                float level, Chain* out, std::size_t out_apart) {
  const hn::CappedTag<float, 8> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Rebind<Chain, decltype(d)> d16;
  const std::size_t lanes = hn::Lanes(d);
  const auto scale = hn::Set(d, 1 / kChainUnit), at = hn::Set(d, level);
  for (std::size_t line = 0; line < lines; ++line) {
    const float* from = u + line * u_apart;
    Chain* to = out + line * out_apart;
    if (mask[line] == 0) {
      std::fill_n(to, 8, kChainFar);
      continue;
    }
    for (std::size_t x = 0; x < 8; x += lanes) {
      const auto length = hn::Ceil(hn::Mul(hn::Sub(at, hn::LoadU(d, from + x)), scale));
      hn::StoreU(hn::DemoteTo(d16, hn::ConvertTo(d32, length)), d16, to + x);
    }
    if (mask[line] != 0xff)
      for (std::size_t x = 0; x < 8; ++x)
        if (!(mask[line] >> x & 1)) to[x] = kChainFar;
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

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(ChainSteps);
HWY_EXPORT(ChainSeeds);
HWY_EXPORT(ChainSidesOf);

void chain_step(const ChainBrick& brick, int steps, Chain* out) {
  HWY_DYNAMIC_DISPATCH(ChainSteps)(brick, steps, out);
}

void chain_seeds(const float* u, std::size_t u_apart, const std::uint8_t* mask, std::size_t lines,
                 float level, Chain* out, std::size_t out_apart) {
  HWY_DYNAMIC_DISPATCH(ChainSeeds)(u, u_apart, mask, lines, level, out, out_apart);
}

void chain_sides(const Chain* chain, const float* u, const ChainLimits& limits, ChainSides& out) {
  HWY_DYNAMIC_DISPATCH(ChainSidesOf)(chain, u, limits, out);
}

}  // namespace h6::kernels
#endif
