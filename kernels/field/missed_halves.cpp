// SPDX-License-Identifier: Apache-2.0
// missed_halves.cpp - the fast twin of missed_halves_ref. Layers of nodes are flat arrays of 81,
// and the last interpolation, along z, is compared at once.
#include "kernels/field/missed_halves.h"

#include <array>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/missed_halves.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline constexpr std::size_t kLayer = 81, kLayerRoom = 88;
// Nodes of a layer in the lower and the upper half along x and y, 64 to a word.
using Flat = std::array<std::uint64_t, 2>;
constexpr Flat nodes_of(int half) {
  Flat nodes{};
  for (std::size_t n = 0; n < kLayer; ++n) {
    const std::size_t x = n % 9, y = n / 9;
    const bool in = (half & 1 ? x >= 4 : x <= 4) && (half & 2 ? y >= 4 : y <= 4);
    nodes[n / 64] |= std::uint64_t(in) << (n % 64);
  }
  return nodes;
}
inline constexpr Flat kHalf[4] = {nodes_of(0), nodes_of(1), nodes_of(2), nodes_of(3)};

// `count` arrays of `width` values, and kStep - 1 others evenly between each two of them.
template <std::size_t kStep>
HWY_INLINE void spread(const float* from, std::size_t count, std::size_t width, float* out) {
  for (std::size_t i = 0; i < count; ++i, from += width)
    for (std::size_t rest = 0; rest < (i + 1 < count ? kStep : 1); ++rest, out += width) {
      const float t = float(rest) / float(kStep);
      if (rest == 0)
        for (std::size_t n = 0; n < width; ++n) out[n] = from[n];
      else
        for (std::size_t n = 0; n < width; ++n) out[n] = from[n] + t * (from[width + n] - from[n]);
    }
}

template <std::size_t kCells>
HWY_INLINE unsigned halves_of(const float* corners, const float* exact, float allowed,
                              float tested) {
  constexpr std::size_t kCount = kCells + 1, kStep = 8 / kCells;
  float lines[kCount * kCount * 9];
  HWY_ALIGN float layers[kCount][kLayerRoom] = {};
  for (std::size_t row = 0; row < kCount * kCount; ++row)
    spread<kStep>(corners + kCount * row, kCount, 1, lines + 9 * row);
  for (std::size_t z = 0; z < kCount; ++z)
    spread<kStep>(lines + 9 * kCount * z, kCount, 9, layers[z]);

  const hn::CappedTag<float, 8> d;
  const auto most = hn::Set(d, allowed), below = hn::Set(d, tested);
  Flat missed[2] = {};  // in the lower and the upper half along z
  for (std::size_t n = 0; n < kLayerRoom; n += hn::Lanes(d)) {
    auto any = hn::FirstN(d, 0), low = any;
    auto from = hn::Load(d, layers[0] + n);
    for (std::size_t z = 0; z < 9; ++z) {
      auto found = from;
      if (z % kStep != 0) {
        const auto to = hn::Load(d, layers[z / kStep + 1] + n);
        const auto t = hn::Set(d, float(z % kStep) / float(kStep));
        found = hn::Add(from, hn::Mul(t, hn::Sub(to, from)));
      }
      if (z < 8 && (z + 1) % kStep == 0) from = hn::Load(d, layers[(z + 1) / kStep] + n);
      const auto value = hn::LoadU(d, exact + kLayer * z + n);
      const auto right = hn::Le(hn::Abs(hn::Sub(value, found)), most);
      const auto miss = hn::AndNot(right, hn::Lt(hn::Abs(value), below));
      if (z == 4)
        low = hn::Or(any, miss), any = miss;
      else
        any = hn::Or(any, miss);
    }
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, low, bytes);
    missed[0][n / 64] |= std::uint64_t{bytes[0]} << (n % 64);
    hn::StoreMaskBits(d, any, bytes);
    missed[1][n / 64] |= std::uint64_t{bytes[0]} << (n % 64);
  }
  unsigned halves = 0;
  for (unsigned half = 0; half < 8; ++half) {
    const Flat &in = kHalf[half & 3], &there = missed[half >> 2];
    halves |= unsigned(((in[0] & there[0]) | (in[1] & there[1])) != 0) << half;
  }
  return halves;
}

unsigned MissedHalves(const float* corners, std::size_t cells, const float* exact, float allowed,
                      float tested) {
  return cells == 2 ? halves_of<2>(corners, exact, allowed, tested)
                    : halves_of<4>(corners, exact, allowed, tested);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(MissedHalves);

unsigned missed_halves(const float* corners, std::size_t cells, const float* exact, float allowed,
                       float tested) {
  return HWY_DYNAMIC_DISPATCH(MissedHalves)(corners, cells, exact, allowed, tested);
}

}  // namespace h6::kernels
#endif
