// triangle_distance.cpp - the fast twin of triangle_distance_ref.
//
// Nodes are visited in Morton order, so that 16 in a row are a compact block of 4 x 2 x 2 nodes,
// no node farther than kRadius from its middle. First the exact distance of the 32 middles to every
// triangle: the smallest at a block, plus kRadius, bounds all its nodes. Then a block looks only at
// triangles that may come below that, which are two or three. Both steps are minima over the whole
// list, so its order does not matter.
//
// In the frame of a triangle the distance is h^2 + min over edges (w^2 + beyond^2), where beyond is
// how far the point lies past the ends of the edge; h^2 alone over the inside. All seven functions
// are affine: on a block they are a constant pattern plus one number.
#include "kernels/triangle_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/triangle_distance.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef H6_TRIANGLE_DISTANCE_TABLES
#define H6_TRIANGLE_DISTANCE_TABLES
namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;  // nodes: 4 x 2 x 2
inline constexpr std::size_t kBlocks = kBrickSamples / kBlock;
inline constexpr float kBlockHalf[3] = {1.5f, 0.5f, 0.5f};
inline constexpr float kRadius = 1.6584f;  // |kBlockHalf|, rounded up
inline constexpr std::size_t kFunctions = 7;
inline constexpr float kRounding = 1e-4f;  // more than float work is wrong by [voxel]

struct MortonNodes {
  alignas(64) float middle_x[kBlocks], middle_y[kBlocks], middle_z[kBlocks];
  alignas(64) float first_x[kBlocks], first_y[kBlocks], first_z[kBlocks];
  alignas(64) float in_x[kBlock], in_y[kBlock], in_z[kBlock];  // from the first node of a block
  std::array<std::uint16_t, kBrickSamples> row;                // Morton -> x fastest
};

constexpr MortonNodes morton_nodes() {
  MortonNodes m{};
  for (std::size_t n = 0; n < kBrickSamples; ++n) {
    std::size_t c[3] = {0, 0, 0};
    for (std::size_t bit = 0; bit < 9; ++bit) c[bit % 3] |= (n >> bit & 1) << (bit / 3);
    m.row[n] = static_cast<std::uint16_t>((c[2] * 8 + c[1]) * 8 + c[0]);
    if (n < kBlock) {
      m.in_x[n] = float(c[0]);
      m.in_y[n] = float(c[1]);
      m.in_z[n] = float(c[2]);
    }
    if (n % kBlock != 0) continue;
    const std::size_t b = n / kBlock;
    m.first_x[b] = float(c[0]);
    m.first_y[b] = float(c[1]);
    m.first_z[b] = float(c[2]);
    m.middle_x[b] = m.first_x[b] + kBlockHalf[0];
    m.middle_y[b] = m.first_y[b] + kBlockHalf[1];
    m.middle_z[b] = m.first_z[b] + kBlockHalf[2];
  }
  return m;
}
inline constexpr MortonNodes kNodes = morton_nodes();

// Middles of the 64 bricks of a tile.
struct TileBricks {
  alignas(64) float x[64], y[64], z[64];
};
constexpr TileBricks tile_bricks() {
  TileBricks t{};
  for (std::size_t b = 0; b < 64; ++b) {
    t.x[b] = float(8 * (b % 4)) + 3.5f;
    t.y[b] = float(8 * (b / 4 % 4)) + 3.5f;
    t.z[b] = float(8 * (b / 16)) + 3.5f;
  }
  return t;
}
inline constexpr TileBricks kTile = tile_bricks();

// For one brick's list; kept by the thread.
struct Room {
  std::vector<float> middle, constant;
};

}  // namespace h6::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, kBlock>;
using VF = hn::Vec<D>;

// The part of |p - triangle|^2 that is not h^2.
HWY_INLINE VF beside_squared(const DistanceFacet& f, const VF (&s)[3], const VF (&w)[3]) {
  const D d;
  const VF zero = hn::Zero(d);
  const auto edge = [&](int e) HWY_ATTR {
    const VF beyond =
        hn::Max(hn::Max(hn::Sub(s[e], hn::Set(d, f.length[e])), hn::Neg(s[e])), zero);
    return hn::MulAdd(beyond, beyond, hn::Mul(w[e], w[e]));
  };
  const VF nearest = hn::Min(hn::Min(edge(0), edge(1)), edge(2));
  const VF inner = hn::Min(hn::Min(w[0], w[1]), w[2]);
  return hn::IfThenZeroElse(hn::Ge(inner, hn::Set(d, f.inside_from)), nearest);
}

// Distances of the 32 middles to one triangle, and what they say about each block.
HWY_INLINE void measure_middles(const DistanceFacet& f, const float* constant, float* middle,
                                float* most) {
  const D d;
  for (std::size_t b = 0; b < kBlocks; b += hn::Lanes(d)) {
    const VF x = hn::Load(d, kNodes.middle_x + b), y = hn::Load(d, kNodes.middle_y + b),
             z = hn::Load(d, kNodes.middle_z + b);
    const auto at = [&](std::size_t k) HWY_ATTR {
      return hn::MulAdd(x, hn::Set(d, f.gx[k]),
                        hn::MulAdd(y, hn::Set(d, f.gy[k]),
                                   hn::MulAdd(z, hn::Set(d, f.gz[k]), hn::Set(d, constant[k]))));
    };
    const VF s[3] = {at(0), at(1), at(2)}, w[3] = {at(3), at(4), at(5)}, h = at(6);
    const VF away = hn::Sqrt(hn::MulAdd(h, h, beside_squared(f, s, w)));
    hn::Store(away, d, middle + b);
    hn::Store(hn::Min(hn::Load(d, most + b), away), d, most + b);
  }
}

HWY_INLINE std::uint32_t blocks_below(const float* middle, const float* limit) {
  const D d;
  std::uint32_t live = 0;
  for (std::size_t b = 0; b < kBlocks; b += hn::Lanes(d)) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::Lt(hn::Load(d, middle + b), hn::Load(d, limit + b)), bits);
    live |= (std::uint32_t{bits[0]} | std::uint32_t{bits[1]} << 8) << b;
  }
  return live;
}

// The functions of a triangle on the nodes of a block, less their value at its first node.
struct Pattern {
  alignas(64) float v[kFunctions][kBlock];
};
HWY_INLINE void make_pattern(const DistanceFacet& f, Pattern& pattern) {
  const D d;
  for (std::size_t n = 0; n < kBlock; n += hn::Lanes(d)) {
    const VF x = hn::Load(d, kNodes.in_x + n), y = hn::Load(d, kNodes.in_y + n),
             z = hn::Load(d, kNodes.in_z + n);
    for (std::size_t k = 0; k < kFunctions; ++k)
      hn::Store(hn::MulAdd(x, hn::Set(d, f.gx[k]),
                           hn::MulAdd(y, hn::Set(d, f.gy[k]), hn::Mul(z, hn::Set(d, f.gz[k])))),
                d, pattern.v[k] + n);
  }
}

// Lowers the squared distances of the blocks in `live`.
HWY_INLINE void lower_blocks(const DistanceFacet& f, const float* constant, std::uint32_t live,
                             float* best) {
  const D d;
  const hn::CappedTag<float, 4> d4;
  Pattern pattern;
  make_pattern(f, pattern);
  for (; live != 0; live &= live - 1) {
    const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(live);
    alignas(32) float first[8];
    for (std::size_t k = 0; k < 8; k += hn::Lanes(d4)) {
      const auto x = hn::Set(d4, kNodes.first_x[b]), y = hn::Set(d4, kNodes.first_y[b]),
                 z = hn::Set(d4, kNodes.first_z[b]);
      hn::Store(hn::MulAdd(x, hn::LoadU(d4, f.gx + k),
                           hn::MulAdd(y, hn::LoadU(d4, f.gy + k),
                                      hn::MulAdd(z, hn::LoadU(d4, f.gz + k),
                                                 hn::LoadU(d4, constant + k)))),
                d4, first + k);
    }
    for (std::size_t n = 0; n < kBlock; n += hn::Lanes(d)) {
      const auto at = [&](std::size_t k) HWY_ATTR {
        return hn::Add(hn::Load(d, pattern.v[k] + n), hn::Set(d, first[k]));
      };
      const VF s[3] = {at(0), at(1), at(2)}, w[3] = {at(3), at(4), at(5)}, h = at(6);
      float* to = best + b * kBlock + n;
      hn::Store(hn::Min(hn::Load(d, to), hn::MulAdd(h, h, beside_squared(f, s, w))), d, to);
    }
  }
}

void FacetDistance(const DistanceFacet* facets, const std::uint32_t* list, std::size_t count,
                   const float* origin, float reach, Room& room, float* distance) {
  const D d;
  alignas(64) float best[kBrickSamples], limit[kBlocks];
  std::fill(best, best + kBrickSamples, reach * reach);
  std::fill(limit, limit + kBlocks, reach);
  room.middle.resize(count * kBlocks + 16);
  room.constant.resize(count * 8);
  float* middle = room.middle.data();
  middle += (64 - reinterpret_cast<std::uintptr_t>(middle) % 64) % 64 / sizeof(float);
  for (std::size_t i = 0; i < count; ++i) {
    const DistanceFacet& f = facets[list[i]];
    float* constant = room.constant.data() + 8 * i;
    for (std::size_t k = 0; k < 8; ++k)
      constant[k] = f.c[k] + (origin[0] * f.gx[k] + origin[1] * f.gy[k] + origin[2] * f.gz[k]);
    measure_middles(f, constant, middle + i * kBlocks, limit);
  }
  // A node is at most kRadius farther than its block's middle, so the nearest triangle of any node
  // is at most 2 kRadius farther from the middle than the nearest one there.
  for (std::size_t b = 0; b < kBlocks; ++b)
    limit[b] = std::min(limit[b] + kRadius, reach) + kRadius + kRounding;
  for (std::size_t i = 0; i < count; ++i)
    if (const std::uint32_t live = blocks_below(middle + i * kBlocks, limit); live != 0)
      lower_blocks(facets[list[i]], room.constant.data() + 8 * i, live, best);
  for (std::size_t n = 0; n < kBrickSamples; n += hn::Lanes(d))
    hn::Store(hn::Sqrt(hn::Load(d, best + n)), d, best + n);
  for (std::size_t n = 0; n < kBrickSamples; ++n) distance[kNodes.row[n]] = best[n];
}

std::uint64_t BricksWithinReach(const DistanceFacet& f, float reach) {
  const D d;
  const VF zero = hn::Zero(d), half = hn::Set(d, 3.5f), within = hn::Set(d, reach + kRounding);
  std::uint64_t near = 0;
  for (std::size_t b = 0; b < 64; b += hn::Lanes(d)) {
    const VF p[3] = {hn::Load(d, kTile.x + b), hn::Load(d, kTile.y + b), hn::Load(d, kTile.z + b)};
    VF box2 = zero;
    for (int k = 0; k < 3; ++k) {
      const VF gap = hn::Max(hn::Sub(hn::Sub(hn::Set(d, f.low[k]), p[k]), half),
                             hn::Sub(hn::Sub(p[k], hn::Set(d, f.high[k])), half));
      const VF apart = hn::Max(gap, zero);
      box2 = hn::MulAdd(apart, apart, box2);
    }
    auto in = hn::Le(box2, hn::Mul(within, within));
    // Planes: of the triangle, both sides, and through its edges, away from it.
    for (std::size_t k = 3; k < kFunctions; ++k) {
      const VF at = hn::MulAdd(p[0], hn::Set(d, f.gx[k]),
                               hn::MulAdd(p[1], hn::Set(d, f.gy[k]),
                                          hn::MulAdd(p[2], hn::Set(d, f.gz[k]),
                                                     hn::Set(d, f.c[k]))));
      const float extent = 3.5f * (std::fabs(f.gx[k]) + std::fabs(f.gy[k]) + std::fabs(f.gz[k]));
      const VF away = k == 6 ? hn::Abs(at) : hn::Neg(at);
      in = hn::And(in, hn::Le(away, hn::Set(d, extent + reach + kRounding)));
    }
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, in, bits);
    near |= (std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8) << b;
  }
  return near;
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

HWY_EXPORT(FacetDistance);
HWY_EXPORT(BricksWithinReach);
HWY_EXPORT(NodesAbove);

namespace {

using Row = std::array<double, 3>;
double dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Row cross(const Row& a, const Row& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Row times(double s, const Row& a) { return {s * a[0], s * a[1], s * a[2]}; }

void set_function(DistanceFacet& f, std::size_t k, const Row& g, const Row& zero_at) {
  f.gx[k] = float(g[0]);
  f.gy[k] = float(g[1]);
  f.gz[k] = float(g[2]);
  f.c[k] = float(-dot(g, zero_at));
}

// Unit, across a.
Row any_normal(const Row& a) {
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::fabs(a[k]) < std::fabs(a[least])) least = k;
  Row e{};
  e[least] = 1;
  const Row n = cross(a, e);
  return times(1 / std::sqrt(dot(n, n)), n);
}

// Three times the segment from `from` along the unit vector `along`; nothing lies over it.
void set_segment(DistanceFacet& f, const Row& from, const Row& along, double length) {
  const Row n = any_normal(along), in = cross(n, along);
  for (std::size_t e = 0; e < 3; ++e) {
    set_function(f, e, along, from);
    set_function(f, 3 + e, in, from);
    f.length[e] = float(length);
  }
  set_function(f, 6, n, from);
  f.inside_from = 1e30f;
}

}  // namespace

DistanceFacet make_distance_facet(const double* t) {
  DistanceFacet f;
  f.gx[7] = f.gy[7] = f.gz[7] = f.c[7] = 0;
  const Row corner[3] = {{t[0], t[1], t[2]}, {t[3], t[4], t[5]}, {t[6], t[7], t[8]}};
  Row edge[3];
  double length[3];
  std::size_t longest = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    const Row &a = corner[e], &b = corner[(e + 1) % 3];
    edge[e] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    length[e] = std::sqrt(dot(edge[e], edge[e]));
    if (length[e] > length[longest]) longest = e;
    f.low[e] = float(std::min({corner[0][e], corner[1][e], corner[2][e]}));
    f.high[e] = float(std::max({corner[0][e], corner[1][e], corner[2][e]}));
  }
  const Row n = cross(edge[2], edge[0]);
  const double n_length = std::sqrt(dot(n, n)), height_over = n_length / length[longest];
  // Below a height of 1e-4 voxel the longest edge alone is right to that.
  if (!(height_over > 1e-4)) {
    const Row along = length[longest] > 1e-9 ? times(1 / length[longest], edge[longest])
                                             : Row{1, 0, 0};
    set_segment(f, corner[longest], along, length[longest]);
    return f;
  }
  const Row normal = times(1 / n_length, n);
  for (std::size_t e = 0; e < 3; ++e) {
    const Row along = times(1 / length[e], edge[e]);
    set_function(f, e, along, corner[e]);
    set_function(f, 3 + e, cross(normal, along), corner[e]);
    f.length[e] = float(length[e]);
  }
  set_function(f, 6, normal, corner[0]);
  // Points on an edge are over the triangle whatever float says, but on a sliver that must not
  // reach past its tips.
  f.inside_from = -float(std::min(2e-6, 1e-5 * height_over / length[longest]));
  return f;
}

std::uint64_t bricks_within_reach(const DistanceFacet& facet, float reach) {
  return HWY_DYNAMIC_DISPATCH(BricksWithinReach)(facet, reach);
}

void facet_distance(const DistanceFacet* facets, const std::uint32_t* list, std::size_t count,
                    const float origin[3], float reach, float* distance) {
  thread_local Room room;
  HWY_DYNAMIC_DISPATCH(FacetDistance)(facets, list, count, origin, reach, room, distance);
}

void nodes_above(const float* distance, float level, std::uint64_t words[8]) {
  HWY_DYNAMIC_DISPATCH(NodesAbove)(distance, level, words);
}

void triangle_distance(const double* corners, std::size_t count, float reach, float* distance) {
  std::vector<DistanceFacet> facets(count);
  std::vector<std::uint32_t> list(count);
  for (std::size_t i = 0; i < count; ++i) {
    facets[i] = make_distance_facet(corners + 9 * i);
    list[i] = static_cast<std::uint32_t>(i);
  }
  const float origin[3] = {0, 0, 0};
  facet_distance(facets.data(), list.data(), count, origin, reach, distance);
}

}  // namespace h6::kernels
#endif
