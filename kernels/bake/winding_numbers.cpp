// SPDX-License-Identifier: Apache-2.0
// winding_numbers.cpp - the fast twin of winding_numbers_ref.cpp: a lane is a place.
#include "kernels/bake/winding_numbers.h"

#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/winding_numbers.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Products and sums stay apart, so all targets round alike.
template <class V>
HWY_INLINE V Dot(V ax, V ay, V az, V bx, V by, V bz) {
  return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}

template <class V>
struct PlaceOf {
  V x, y, z;
};
template <class D, class V = hn::Vec<D>>
HWY_INLINE PlaceOf<V> Shifted(D d, const WindingPlaces& offsets, std::size_t i,
                              const double (&base)[3], const double (&origin)[3]) {
  return {hn::Add(hn::Load(d, offsets.x + i), hn::Set(d, float(base[0] - origin[0]))),
          hn::Add(hn::Load(d, offsets.y + i), hn::Set(d, float(base[1] - origin[1]))),
          hn::Add(hn::Load(d, offsets.z + i), hn::Set(d, float(base[2] - origin[2])))};
}

template <class V>
struct TurnsOf {
  V x, y, full;
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE void Turn(D d, const WindingLeaf& leaf, const PlaceOf<V>& p, TurnsOf<V>& sum) {
  V tx[24], ty[24], tz[24], length[24];
  for (std::uint32_t v = 0; v < leaf.vertices; ++v) {
    tx[v] = hn::Sub(hn::Set(d, leaf.x[v]), p.x);
    ty[v] = hn::Sub(hn::Set(d, leaf.y[v]), p.y);
    tz[v] = hn::Sub(hn::Set(d, leaf.z[v]), p.z);
    length[v] = hn::Sqrt(Dot(tx[v], ty[v], tz[v], tx[v], ty[v], tz[v]));
  }
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  for (std::uint32_t t = 0; t < leaf.triangles; ++t) {
    const std::uint32_t a = leaf.corner[3 * t], b = leaf.corner[3 * t + 1],
                        c = leaf.corner[3 * t + 2];
    const V nx = hn::Sub(hn::Mul(ty[b], tz[c]), hn::Mul(tz[b], ty[c]));
    const V ny = hn::Sub(hn::Mul(tz[b], tx[c]), hn::Mul(tx[b], tz[c]));
    const V nz = hn::Sub(hn::Mul(tx[b], ty[c]), hn::Mul(ty[b], tx[c]));
    V y = Dot(tx[a], ty[a], tz[a], nx, ny, nz);
    V x = hn::Mul(hn::Mul(length[a], length[b]), length[c]);
    x = hn::Add(x, hn::Mul(Dot(tx[a], ty[a], tz[a], tx[b], ty[b], tz[b]), length[c]));
    x = hn::Add(x, hn::Mul(Dot(tx[b], ty[b], tz[b], tx[c], ty[c], tz[c]), length[a]));
    x = hn::Add(x, hn::Mul(Dot(tx[c], ty[c], tz[c], tx[a], ty[a], tz[a]), length[b]));
    const V most = hn::Max(hn::Abs(x), hn::Abs(y));
    const auto counts = hn::Gt(most, hn::Set(d, 1e-30f));
    x = hn::IfThenElse(counts, hn::Div(x, most), one);
    y = hn::IfThenElseZero(counts, hn::Div(y, most));
    const V before = sum.y;
    sum.y = hn::Add(hn::Mul(sum.x, y), hn::Mul(before, x));
    sum.x = hn::Sub(hn::Mul(sum.x, x), hn::Mul(before, y));
    const auto from_below = hn::Lt(before, zero), to_below = hn::Lt(sum.y, zero);
    const auto up = hn::Ge(y, zero);
    const auto more = hn::And(up, hn::AndNot(from_below, to_below));
    const auto less = hn::AndNot(up, hn::AndNot(to_below, from_below));
    sum.full = hn::Add(sum.full, hn::IfThenElseZero(more, one));
    sum.full = hn::Sub(sum.full, hn::IfThenElseZero(less, one));
  }
  const V most = hn::Max(hn::Abs(sum.x), hn::Abs(sum.y));
  sum.x = hn::Div(sum.x, most);
  sum.y = hn::Div(sum.y, most);
}

// The dipoles' sums, and the turns, of all places.
void WindingSums(const WindingCluster* clusters, const std::uint32_t* far, std::size_t far_count,
                 const WindingLeaf* leaves, const std::uint32_t* near, std::size_t near_count,
                 const double (&base)[3], const WindingPlaces& offsets,
                 float (&sums)[4][kWindingPlaces]) {
  const hn::CappedTag<float, kWindingPlaces> d;
  using V = hn::Vec<decltype(d)>;
  for (std::size_t i = 0; i < kWindingPlaces; i += hn::Lanes(d)) {
    V sum = hn::Zero(d);
    const PlaceOf<V> p = Shifted(d, offsets, i, base, {0, 0, 0});
    for (std::size_t k = 0; k < far_count; ++k) {
      const WindingCluster& c = clusters[far[k]];
      const V x = hn::Sub(hn::Set(d, c.middle[0]), p.x), y = hn::Sub(hn::Set(d, c.middle[1]), p.y),
              z = hn::Sub(hn::Set(d, c.middle[2]), p.z);
      const V far2 = Dot(x, y, z, x, y, z);
      const V along =
          Dot(x, y, z, hn::Set(d, c.dipole[0]), hn::Set(d, c.dipole[1]), hn::Set(d, c.dipole[2]));
      sum = hn::Add(sum, hn::Div(along, hn::Mul(far2, hn::Sqrt(far2))));
    }
    TurnsOf<V> turns{hn::Set(d, 1.0f), hn::Zero(d), hn::Zero(d)};
    for (std::size_t k = 0; k < near_count; ++k) {
      const WindingLeaf& leaf = leaves[near[k]];
      Turn(d, leaf, Shifted(d, offsets, i, base, leaf.origin), turns);
    }
    hn::StoreU(sum, d, sums[0] + i);
    hn::StoreU(turns.x, d, sums[1] + i);
    hn::StoreU(turns.y, d, sums[2] + i);
    hn::StoreU(turns.full, d, sums[3] + i);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(WindingSums);

void winding_numbers(const WindingCluster* clusters, const std::uint32_t* far,
                     std::size_t far_count, const WindingLeaf* leaves, const std::uint32_t* near,
                     std::size_t near_count, const double (&base)[3], const WindingPlaces& offsets,
                     float (&number)[kWindingPlaces]) {
  float sums[4][kWindingPlaces];
  HWY_DYNAMIC_DISPATCH(WindingSums)
  (clusters, far, far_count, leaves, near, near_count, base, offsets, sums);
  for (std::size_t i = 0; i < kWindingPlaces; ++i)
    number[i] = float(double(sums[0][i]) + double(sums[3][i]) +
                      std::atan2(double(sums[2][i]), double(sums[1][i])) / (2 * std::numbers::pi));
}

}  // namespace h6::kernels
#endif
