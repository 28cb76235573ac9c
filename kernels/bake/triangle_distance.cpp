// SPDX-License-Identifier: Apache-2.0
// triangle_distance.cpp - the fast twin of triangle_distance_ref.
//
// A brick is 32 blocks of 4 x 2 x 2 nodes. A triangle is compared at the nodes of a block only
// where it may be the nearest to one of them: the block meets its FacetRegion, and the triangle's
// plane is nearer than the largest distance of the block so far. Both are tested at the middles of
// all blocks at once: within a block an affine function differs from its value there by at most its
// change over half a block. Neither test can drop a triangle that lowers a distance, so the order
// of the triangles does not change a bit.
//
// In the frame of a triangle the squared distance is h^2 over the inside, else
// h^2 + min over edges (w^2 + beyond^2), where beyond is the distance past the ends of the edge.
// All seven functions are affine: on a block they are a constant pattern plus one number. Edges
// that other triangles answer for, with their ends, are left out of the minimum: half of all edges
// on a closed mesh. The result is then the distance to a part of the triangle, so never too small.
#include "kernels/bake/triangle_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/triangle_distance.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "kernels/bake/bricks_met-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline constexpr std::uint32_t kEachVisit = 16;

// The functions of a triangle at places relative to a first one, less their values there.
template <std::size_t kCount>
struct Pattern {
  alignas(64) float v[kFunctions][kCount];
};
template <std::size_t kCount>
HWY_INLINE void make_pattern(const DistanceFacet& f, const float* px, const float* py,
                             const float* pz, Pattern<kCount>& pattern) {
  const D d;
  for (std::size_t n = 0; n < kCount; n += hn::Lanes(d)) {
    const VF x = hn::Load(d, px + n), y = hn::Load(d, py + n), z = hn::Load(d, pz + n);
    for (std::size_t k = 0; k < kFunctions; ++k)
      hn::Store(hn::MulAdd(x, hn::Set(d, f.gx[k]),
                           hn::MulAdd(y, hn::Set(d, f.gy[k]), hn::Mul(z, hn::Set(d, f.gz[k])))),
                d, pattern.v[k] + n);
  }
}

// c + g.p of `count` functions at once.
HWY_INLINE void values_at(const float* gx, const float* gy, const float* gz, const float* c,
                          std::size_t count, float px, float py, float pz, float* out) {
  const hn::CappedTag<float, 8> d;
  const auto x = hn::Set(d, px), y = hn::Set(d, py), z = hn::Set(d, pz);
  for (std::size_t k = 0; k < count; k += hn::Lanes(d))
    hn::Store(hn::MulAdd(x, hn::LoadU(d, gx + k),
                         hn::MulAdd(y, hn::LoadU(d, gy + k),
                                    hn::MulAdd(z, hn::LoadU(d, gz + k), hn::LoadU(d, c + k)))),
              d, out + k);
}

// One triangle, prepared for all bricks of its tile.
struct Ready {
  Ready(const DistanceFacet& facet, const FacetRegion& where) : f(facet), region(where) {}
  const DistanceFacet& f;
  const FacetRegion& region;
  Pattern<kBlock> nodes;
  Pattern<kBlocks> middles;
  alignas(64) float planes[kPlanes][kBlocks];  // as in Pattern; those in use
  // How far off an edge the first block's node must be for a node of this block to be inside.
  alignas(64) float inside_from[3][kBlocks];
  Gains gain = {};
};
HWY_INLINE void make_ready(Ready& t) {
  const D d;
  const FacetRegion& r = t.region;
  make_pattern(t.f, kNodes.in_x, kNodes.in_y, kNodes.in_z, t.nodes);
  make_pattern(t.f, kNodes.middle_x, kNodes.middle_y, kNodes.middle_z, t.middles);
  for (std::size_t e = r.weighed; e < 3; ++e)
    for (std::size_t b = 0; b < kBlocks; b += hn::Lanes(d))
      hn::Store(hn::Sub(hn::Set(d, t.f.inside_from), hn::Load(d, t.middles.v[3 + e] + b)), d,
                t.inside_from[e] + b);
  set_gains(t.f, r, kBlockHalf, t.gain);
  const std::uint32_t corners = r.corners;
  std::uint32_t used = r.edges | (corners & 1) * 0x0078u | (corners >> 1 & 1) * 0x0780u |
                       (corners >> 2 & 1) * 0x7800u;
  for (; used != 0; used &= used - 1) {
    const std::size_t k = hwy::Num0BitsBelowLS1Bit_Nonzero32(used);
    for (std::size_t b = 0; b < kBlocks; b += hn::Lanes(d))
      hn::Store(
          hn::MulAdd(hn::Load(d, kNodes.middle_x + b), hn::Set(d, r.gx[k]),
                     hn::MulAdd(hn::Load(d, kNodes.middle_y + b), hn::Set(d, r.gy[k]),
                                hn::Mul(hn::Load(d, kNodes.middle_z + b), hn::Set(d, r.gz[k])))),
          d, t.planes[k] + b);
  }
}

// A triangle's functions and the planes of its region at the first node of a brick.
struct FirstNode {
  alignas(64) float function[8], plane[kPlanes];
};

// The blocks of a brick whose middles pass a series of tests. All vectors of a brick are tested
// together, so that each operand is broadcast once.
struct Blocks {
  static constexpr std::size_t kLanes = hn::MaxLanes(D()), kVectors = kBlocks / kLanes;
  hn::Mask<D> in[kVectors];
  HWY_INLINE void from(const float* pattern, float least) {
    const D d;
    for (std::size_t v = 0; v < kVectors; ++v)
      in[v] = hn::Ge(hn::Load(d, pattern + v * kLanes), hn::Set(d, least));
  }
  HWY_INLINE void to(const float* pattern, float most) {
    const D d;
    for (std::size_t v = 0; v < kVectors; ++v)
      in[v] = hn::Le(hn::Load(d, pattern + v * kLanes), hn::Set(d, most));
  }
  HWY_INLINE void and_from(const float* pattern, float least) {
    Blocks other;
    other.from(pattern, least);
    for (std::size_t v = 0; v < kVectors; ++v) in[v] = hn::And(in[v], other.in[v]);
  }
  HWY_INLINE void and_to(const float* pattern, float most) {
    Blocks other;
    other.to(pattern, most);
    for (std::size_t v = 0; v < kVectors; ++v) in[v] = hn::And(in[v], other.in[v]);
  }
  HWY_INLINE void add(const Blocks& other) {
    for (std::size_t v = 0; v < kVectors; ++v) in[v] = hn::Or(in[v], other.in[v]);
  }
  HWY_INLINE std::uint32_t bits() const {
    const D d;
    std::uint32_t all = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(d, in[v], bytes);
      all |= (std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8) << v * kLanes;
    }
    return all;
  }
};

// The blocks of a brick where the triangle may lower a distance; `most`: the largest square of each
// block so far.
HWY_INLINE std::uint32_t live_blocks(const Ready& t, const FirstNode& first, const float* most) {
  const D d;
  const FacetRegion& r = t.region;
  const float *g = t.gain.function, *half = t.f.half, *at = first.function;
  const auto& pattern = t.middles.v;
  const auto to_plane = [&](Blocks& blocks, std::size_t k) HWY_ATTR {
    blocks.and_to(t.planes[k], t.gain.plane[k] - first.plane[k]);
  };
  Blocks live;
  live.from(pattern[3], -g[3] - at[3]);
  live.and_from(pattern[4], -g[4] - at[4]);
  live.and_from(pattern[5], -g[5] - at[5]);
  for (std::size_t e = 0; e < 3; ++e)
    if (r.edges >> e & 1) {
      Blocks beyond;
      beyond.to(pattern[3 + e], g[3 + e] - at[3 + e]);
      to_plane(beyond, e);
      beyond.and_from(pattern[e], -(half[e] + g[e]) - at[e]);
      beyond.and_to(pattern[e], half[e] + g[e] - at[e]);
      live.add(beyond);
    }
  for (std::size_t v = 0; v < 3; ++v)
    if (r.corners >> v & 1) {
      const std::size_t u = (v + 2) % 3, p = 3 + 4 * v;
      Blocks beyond;
      beyond.to(pattern[v], g[v] - half[v] - at[v]);
      beyond.and_from(pattern[u], half[u] - g[u] - at[u]);
      for (std::size_t k = p; k < p + 4; ++k) to_plane(beyond, k);
      live.add(beyond);
    }
  for (std::size_t v = 0; v < Blocks::kVectors; ++v) {
    const std::size_t b = v * Blocks::kLanes;
    const VF h = hn::Add(hn::Load(d, pattern[6] + b), hn::Set(d, at[6]));
    const VF gap = hn::Max(hn::Sub(hn::Abs(h), hn::Set(d, g[6])), hn::Zero(d));
    live.in[v] = hn::And(live.in[v], hn::Le(hn::Mul(gap, gap), hn::Load(d, most + b)));
  }
  return live.bits();
}

// The same for a triangle that may be the nearest everywhere.
HWY_NOINLINE std::uint32_t live_blocks_everywhere(const Ready& t, const FirstNode& first,
                                                  const float* most) {
  const D d;
  Blocks live;
  for (std::size_t v = 0; v < Blocks::kVectors; ++v) {
    const std::size_t b = v * Blocks::kLanes;
    const auto at = [&](std::size_t k) HWY_ATTR {
      return hn::Add(hn::Load(d, t.middles.v[k] + b), hn::Set(d, first.function[k]));
    };
    const VF s[3] = {at(0), at(1), at(2)}, w[3] = {at(3), at(4), at(5)}, h = at(6);
    const VF away = hn::Sqrt(hn::MulAdd(h, h, beside_squared<3>(t.f, s, w)));
    live.in[v] =
        hn::Le(hn::Sub(away, hn::Set(d, kRadius + kRounding)), hn::Sqrt(hn::Load(d, most + b)));
  }
  return live.bits();
}

// Lowers the squared distances of the blocks in `live`.
template <int kEdges>
HWY_INLINE void lower_blocks(const Ready& t, const float* first, std::uint32_t live, float* best) {
  const D d;
  const DistanceFacet& f = t.f;
  const VF zero = hn::Zero(d);
  for (std::size_t n = 0; n < kBlock; n += hn::Lanes(d)) {
    // Values at the nodes of a block whose middle is the brick's first node.
    const auto node = [&](std::size_t k) HWY_ATTR {
      return hn::Add(hn::Load(d, t.nodes.v[k] + n), hn::Set(d, first[k]));
    };
    const VF s[3] = {node(0), node(1), node(2)}, w[3] = {node(3), node(4), node(5)}, h = node(6);
    for (std::uint32_t left = live; left != 0; left &= left - 1) {
      const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
      const auto at = [&](VF value, std::size_t k)
                          HWY_ATTR { return hn::Add(value, hn::Set(d, t.middles.v[k][b])); };
      VF nearest = hn::Set(d, kNobodyNear);
      hn::Mask<D> inside;
      for (std::size_t e = 0; e < 3; ++e) {
        hn::Mask<D> in;
        if (e < kEdges) {
          const VF along = at(s[e], e), off = at(w[e], 3 + e);
          const VF beyond = hn::Max(hn::Sub(hn::Abs(along), hn::Set(d, f.half[e])), zero);
          const VF squared = hn::MulAdd(beyond, beyond, hn::Mul(off, off));
          nearest = e == 0 ? squared : hn::Min(nearest, squared);
          in = hn::Ge(off, hn::Set(d, f.inside_from));
        } else {
          in = hn::Ge(w[e], hn::Set(d, t.inside_from[e][b]));
        }
        inside = e == 0 ? in : hn::And(inside, in);
      }
      const VF at_h = at(h, 6), beside = hn::IfThenZeroElse(inside, nearest);
      float* to = best + b * kBlock + n;
      hn::Store(hn::Min(hn::Load(d, to), hn::MulAdd(at_h, at_h, beside)), d, to);
    }
  }
}

// Recomputes the largest square of the blocks in `lowered`.
HWY_INLINE void tell_farthest(std::uint32_t lowered, const float* best, float* most) {
  const D d;
  for (; lowered != 0; lowered &= lowered - 1) {
    const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(lowered);
    VF farthest = hn::Load(d, best + b * kBlock);
    for (std::size_t n = hn::Lanes(d); n < kBlock; n += hn::Lanes(d))
      farthest = hn::Max(farthest, hn::Load(d, best + b * kBlock + n));
    most[b] = hn::GetLane(hn::MaxOfLanes(d, farthest));
  }
}

// Compares one triangle in the bricks of `near`.
template <int kEdges>
HWY_INLINE void weigh(const DistanceFacet& f, const FacetRegion& r, std::uint64_t near,
                      std::int32_t name, TileRoom& room) {
  std::uint64_t bricks = bricks_met<kEdges>(f, r, near, name, room);
  if (bricks == 0) return;
  Ready t(f, r);
  make_ready(t);
  for (; bricks != 0; bricks &= bricks - 1) {
    const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero64(bricks);
    const float x = float(8 * (b % 4)), y = float(8 * (b / 4 % 4)), z = float(8 * (b / 16));
    FirstNode first;
    values_at(f.gx, f.gy, f.gz, f.c, 8, x, y, z, first.function);
    if ((r.edges | r.corners) != 0) values_at(r.gx, r.gy, r.gz, r.c, kPlanes, x, y, z, first.plane);
    float *squared = room.squared + b * kBrickSamples, *most = room.most + b * kBlocks;
    // The old largest square stays an upper bound, so it need not be recomputed each time.
    const std::uint32_t visit = room.visits[b]++;
    if (visit < kEachVisit || visit % kEachVisit == 0) {
      tell_farthest(room.lowered[b], squared, most);
      room.lowered[b] = 0;
    }
    const std::uint32_t live =
        r.everywhere ? live_blocks_everywhere(t, first, most) : live_blocks(t, first, most);
    if (live != 0) {
      lower_blocks<kEdges>(t, first.function, live, squared);
      room.lowered[b] |= live;
    }
  }
}

void TileDistance(const DistanceFacet* facets, const FacetRegion* regions,
                  const std::uint64_t* near, const std::int32_t* names, std::size_t count,
                  float reach, TileRoom& room) {
  std::fill_n(room.middle, 64, std::numeric_limits<float>::max());
  std::fill_n(room.nearest, 64, kNobody);
  std::uint64_t used = 0;
  for (std::size_t i = 0; i < count; ++i) used |= near[i];
  for (; used != 0; used &= used - 1) {
    const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero64(used);
    std::fill_n(room.squared + b * kBrickSamples, kBrickSamples, reach * reach);
    std::fill_n(room.most + b * kBlocks, kBlocks, reach * reach);
    room.lowered[b] = room.visits[b] = 0;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (near[i] == 0) continue;
    const auto weighed = regions[i].weighed == 0   ? weigh<0>
                         : regions[i].weighed == 1 ? weigh<1>
                         : regions[i].weighed == 2 ? weigh<2>
                                                   : weigh<3>;
    weighed(facets[i], regions[i], near[i], names[i], room);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(TileDistance);

void tile_distance(const DistanceFacet* facets, const FacetRegion* regions,
                   const std::uint64_t* near, const std::int32_t* names, std::size_t count,
                   float reach, TileRoom& room) {
  HWY_DYNAMIC_DISPATCH(TileDistance)(facets, regions, near, names, count, reach, room);
}

void triangle_distance(const double* corners, std::size_t count, float reach, float* distance) {
  std::vector<DistanceFacet> facets(count);
  const std::vector<FacetRegion> regions(count);
  const std::vector<std::uint64_t> near(std::max<std::size_t>(count, 1), 1);
  for (std::size_t i = 0; i < count; ++i) facets[i] = make_distance_facet(corners + 9 * i);
  const auto room = std::make_unique<TileRoom>();
  if (count == 0) std::fill_n(room->squared, kBrickSamples, reach * reach);
  const std::vector<std::int32_t> names(count, 0);
  tile_distance(facets.data(), regions.data(), near.data(), names.data(), count, reach, *room);
  brick_distance(*room, 0, distance);
}

}  // namespace h6::kernels
#endif
