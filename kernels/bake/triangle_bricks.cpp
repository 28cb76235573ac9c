// SPDX-License-Identifier: Apache-2.0
// triangle_bricks.cpp - finds the bricks of a tile that a triangle comes near, and compares the
// nodes of a brick with a level.
#include <cmath>

#include "kernels/bake/triangle_distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/triangle_bricks.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "kernels/bake/beside-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// BricksWithinReach for one vector of bricks. A function apart from the loop, so that compilers
// read its constants in place: few triangles come near more than one vector.
HWY_NOINLINE std::uint64_t some_within_reach(const DistanceFacet& f, const float* first,
                                             const float* extent, float reach, std::size_t b) {
  const D d;
  const VF p[3] = {hn::Add(hn::Load(d, kTile.x + b), hn::Set(d, first[0])),
                   hn::Add(hn::Load(d, kTile.y + b), hn::Set(d, first[1])),
                   hn::Add(hn::Load(d, kTile.z + b), hn::Set(d, first[2]))};
  VF value[kFunctions];
  for (std::size_t k = 0; k < kFunctions; ++k)
    value[k] = hn::MulAdd(p[0], hn::Set(d, f.gx[k]),
                          hn::MulAdd(p[1], hn::Set(d, f.gy[k]),
                                     hn::MulAdd(p[2], hn::Set(d, f.gz[k]), hn::Set(d, f.c[k]))));
  // Planes: both sides of the triangle's own, and those through its edges, outwards.
  const VF s[3] = {value[0], value[1], value[2]}, w[3] = {value[3], value[4], value[5]};
  auto in = hn::Le(hn::Abs(value[6]), hn::Set(d, extent[6]));
  for (std::size_t e = 0; e < 3; ++e) in = hn::And(in, hn::Ge(w[e], hn::Set(d, -extent[3 + e])));
  // The ball around the brick.
  const float ball = reach + kBrickRadius + kRounding;
  in = hn::And(in, hn::Le(hn::MulAdd(value[6], value[6], beside_squared<3>(f, s, w)),
                          hn::Set(d, ball * ball)));
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, in, bits);
  return std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8;
}

std::uint64_t BricksWithinReach(const DistanceFacet& f, const float* first, float reach) {
  const D d;
  const VF zero = hn::Zero(d);
  const float within = reach + kRounding;
  const hn::CappedTag<float, 8> d8;
  alignas(32) float extent[8];  // of a brick and its reach along the functions
  for (std::size_t k = 0; k < 8; k += hn::Lanes(d8))
    hn::Store(hn::MulAdd(hn::Set(d8, 3.5f),
                         hn::Add(hn::Add(hn::Abs(hn::LoadU(d8, f.gx + k)),
                                         hn::Abs(hn::LoadU(d8, f.gy + k))),
                                 hn::Abs(hn::LoadU(d8, f.gz + k))),
                         hn::Set(d8, within)),
              d8, extent + k);
  std::uint64_t near = 0;
  for (std::size_t b = 0; b < 64; b += hn::Lanes(d)) {
    const float* middle[3] = {kTile.x + b, kTile.y + b, kTile.z + b};
    VF box2 = zero;
    for (int k = 0; k < 3; ++k) {
      const VF p = hn::Add(hn::Load(d, middle[k]), hn::Set(d, first[k]));
      const VF gap = hn::Max(hn::Sub(hn::Set(d, f.low[k] - 3.5f), p),
                             hn::Sub(p, hn::Set(d, f.high[k] + 3.5f)));
      const VF apart = hn::Max(gap, zero);
      box2 = hn::MulAdd(apart, apart, box2);
    }
    const auto in = hn::Le(box2, hn::Set(d, within * within));
    if (hn::AllFalse(d, in)) continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, in, bits);
    near |= ((std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8) &
             some_within_reach(f, first, extent, reach, b))
            << b;
  }
  return near;
}

void BrickDistance(const TileRoom& room, std::size_t brick, float* distance) {
  const hn::CappedTag<float, 4> d;
  const float* from = room.squared + brick * kBrickSamples;
  for (std::size_t b = 0; b < kBlocks; ++b)
    for (std::size_t row = 0; row < 4; ++row) {
      const std::size_t x = 4 * (b % 2), y = 2 * (b / 2 % 4) + row % 2, z = 2 * (b / 8) + row / 2;
      for (std::size_t n = 0; n < 4; n += hn::Lanes(d))
        hn::StoreU(hn::Sqrt(hn::LoadU(d, from + b * kBlock + 4 * row + n)), d,
                   distance + (z * 8 + y) * 8 + x + n);
    }
}

void NodesAbove(const float* distance, float level, std::uint64_t* words) {
  const hn::CappedTag<float, 16> d;
  const auto limit = hn::Set(d, level);
  for (std::size_t z = 0; z < kBrickSamples / 64; ++z) {
    std::uint64_t word = 0;
    for (std::size_t n = 0; n < 64; n += hn::Lanes(d)) {
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, hn::Gt(hn::LoadU(d, distance + 64 * z + n), limit), bits);
      word |= (std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8) << n;
    }
    words[z] = word;
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(BricksWithinReach);
HWY_EXPORT(BrickDistance);
HWY_EXPORT(NodesAbove);

std::uint64_t bricks_within_reach(const DistanceFacet& facet, const float first[3], float reach) {
  return HWY_DYNAMIC_DISPATCH(BricksWithinReach)(facet, first, reach);
}

void brick_distance(const TileRoom& room, std::size_t brick, float* distance) {
  HWY_DYNAMIC_DISPATCH(BrickDistance)(room, brick, distance);
}

void nodes_above(const float* distance, float level, std::uint64_t words[8]) {
  HWY_DYNAMIC_DISPATCH(NodesAbove)(distance, level, words);
}

}  // namespace h6::kernels
#endif
