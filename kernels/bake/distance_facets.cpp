// SPDX-License-Identifier: Apache-2.0
// distance_facets.cpp - the fast twin of make_distance_facet: a triangle per lane of doubles, with
// the same operations in the same order, so with the same bits. The rare triangles without area go
// to make_distance_facet itself.
#include <algorithm>
#include <cstddef>

#include "kernels/bake/triangle_distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/distance_facets.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_HAVE_FLOAT64 && HWY_TARGET != HWY_SCALAR
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;
inline constexpr std::size_t kLanes = hn::MaxLanes(D());

struct Row {
  V x, y, z;
};
HWY_INLINE V dot(const Row& a, const Row& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Row cross(const Row& a, const Row& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
HWY_INLINE Row times(V s, const Row& a) {
  return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
HWY_INLINE Row minus(const Row& a, const Row& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

// Facets as columns: row k holds float k of each DistanceFacet.
constexpr std::size_t kRows = sizeof(DistanceFacet) / sizeof(float);
struct Staged {
  alignas(32) float row[kRows][kLanes];
  HWY_INLINE void put(std::size_t k, V value) {
    const hn::Rebind<float, D> d;
    hn::Store(hn::DemoteTo(d, value), d, row[k]);
  }
  HWY_INLINE void put_function(std::size_t k, const Row& g, const Row& zero_at) {
    put(k, g.x);
    put(8 + k, g.y);
    put(16 + k, g.z);
    put(24 + k, hn::Neg(dot(g, zero_at)));
  }
  // Transposes four floats of four facets at a time, where vectors have four lanes or more.
  HWY_INLINE void take(std::size_t count, DistanceFacet* facets) const {
    const auto number = [&](std::size_t i) { return reinterpret_cast<float*>(facets + i); };
    std::size_t taken = 0;
    if constexpr (kLanes >= 4) {
      const hn::CappedTag<float, 4> d;
      for (; taken + 4 <= count; taken += 4) {
        for (std::size_t k = 0; k + 4 <= kRows; k += 4) {
          const auto a = hn::LoadU(d, row[k] + taken), b = hn::LoadU(d, row[k + 1] + taken),
                     c = hn::LoadU(d, row[k + 2] + taken), e = hn::LoadU(d, row[k + 3] + taken);
          const auto ab = hn::InterleaveLower(d, a, b), ce = hn::InterleaveLower(d, c, e);
          const auto ab2 = hn::InterleaveUpper(d, a, b), ce2 = hn::InterleaveUpper(d, c, e);
          hn::StoreU(hn::ConcatLowerLower(d, ce, ab), d, number(taken) + k);
          hn::StoreU(hn::ConcatUpperUpper(d, ce, ab), d, number(taken + 1) + k);
          hn::StoreU(hn::ConcatLowerLower(d, ce2, ab2), d, number(taken + 2) + k);
          hn::StoreU(hn::ConcatUpperUpper(d, ce2, ab2), d, number(taken + 3) + k);
        }
        for (std::size_t k = kRows / 4 * 4; k < kRows; ++k)
          for (std::size_t i = taken; i < taken + 4; ++i) number(i)[k] = row[k][i];
      }
    }
    for (; taken < count; ++taken)
      for (std::size_t k = 0; k < kRows; ++k) number(taken)[k] = row[k][taken];
  }
};

void MakeFacets(const double* corners, std::size_t count, DistanceFacet* facets) {
  const D d;
  const hn::RebindToSigned<D> di;
  constexpr std::size_t kHalf = 32, kInside = 35, kLow = 36, kHigh = 39;
  static_assert(offsetof(DistanceFacet, half) == kHalf * sizeof(float) &&
                offsetof(DistanceFacet, inside_from) == kInside * sizeof(float) &&
                offsetof(DistanceFacet, low) == kLow * sizeof(float) &&
                offsetof(DistanceFacet, high) == kHigh * sizeof(float));
  const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  Staged staged;
  for (std::size_t k = 7; k < 32; k += 8) staged.put(k, hn::Zero(d));
  const auto nine = hn::Mul(hn::Iota(di, 0), hn::Set(di, 9));
  for (std::size_t first = 0; first < count; first += kLanes) {
    // The last triangle fills up the last vector.
    const std::size_t some = std::min(kLanes, count - first);
    const auto from = hn::Min(nine, hn::Set(di, std::int64_t(9 * (some - 1))));
    const auto coordinate = [&](std::size_t k) HWY_ATTR {
      return hn::GatherIndex(d, corners + 9 * first + k, from);
    };
    Row corner[3], edge[3];
    for (std::size_t c = 0; c < 3; ++c)
      corner[c] = {coordinate(3 * c), coordinate(3 * c + 1), coordinate(3 * c + 2)};
    V length[3];
    for (std::size_t e = 0; e < 3; ++e) {
      edge[e] = minus(corner[(e + 1) % 3], corner[e]);
      length[e] = hn::Sqrt(dot(edge[e], edge[e]));
    }
    const auto bounds = [&](std::size_t k, V a, V b, V c) HWY_ATTR {
      staged.put(kLow + k, hn::Min(hn::Min(a, b), c));
      staged.put(kHigh + k, hn::Max(hn::Max(a, b), c));
    };
    bounds(0, corner[0].x, corner[1].x, corner[2].x);
    bounds(1, corner[0].y, corner[1].y, corner[2].y);
    bounds(2, corner[0].z, corner[1].z, corner[2].z);
    const V longest = hn::Max(hn::Max(length[0], length[1]), length[2]);
    const Row n = cross(edge[2], edge[0]);
    const V n_length = hn::Sqrt(dot(n, n)), height_over = hn::Div(n_length, longest);
    const Row normal = times(hn::Div(one, n_length), n);
    for (std::size_t e = 0; e < 3; ++e) {
      const Row along = times(hn::Div(one, length[e]), edge[e]);
      const Row &a = corner[e], &b = corner[(e + 1) % 3];
      const Row middle = {hn::Div(hn::Add(a.x, b.x), two), hn::Div(hn::Add(a.y, b.y), two),
                          hn::Div(hn::Add(a.z, b.z), two)};
      staged.put_function(e, along, middle);
      staged.put_function(3 + e, cross(normal, along), corner[e]);
      staged.put(kHalf + e, hn::Div(length[e], two));
    }
    staged.put_function(6, normal, corner[0]);
    staged.put(kInside, hn::Neg(hn::Min(hn::Set(d, 2e-6),
                                        hn::Div(hn::Mul(hn::Set(d, 1e-5), height_over), longest))));
    DistanceFacet* to = facets + first;
    staged.take(some, to);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::Gt(height_over, hn::Set(d, 1e-4)), bits);
    for (std::size_t i = 0; i < some; ++i)
      if (!(bits[0] >> i & 1)) to[i] = make_distance_facet(corners + 9 * (first + i));
  }
}
#else
void MakeFacets(const double* corners, std::size_t count, DistanceFacet* facets) {
  for (std::size_t i = 0; i < count; ++i) facets[i] = make_distance_facet(corners + 9 * i);
}
#endif

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(MakeFacets);

void make_distance_facets(const double* corners, std::size_t count, DistanceFacet* facets) {
  HWY_DYNAMIC_DISPATCH(MakeFacets)(corners, count, facets);
}

}  // namespace h6::kernels
#endif
