// SPDX-License-Identifier: Apache-2.0
// nearest_eight_set.cpp - the fast twin of nearest_eight_set_ref.cpp. Triangles are prepared in
// double, since the cross product of a long sliver has no correct digit in float; boxes in float.
#include <cmath>

#include "kernels/bake/nearest_eight.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/nearest_eight_set.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Row {
  hn::Vec<D> x, y, z;
};
using Wide = hn::CappedTag<double, 8>;
using Narrow = hn::CappedTag<float, 8>;
using VD = hn::Vec<Wide>;
using RowD = Row<Wide>;
using RowF = Row<Narrow>;

template <class D, class T = hn::TFromD<D>>
HWY_INLINE Row<D> load(D d, const T (&v)[3][8], std::size_t i) {
  return {hn::Load(d, v[0] + i), hn::Load(d, v[1] + i), hn::Load(d, v[2] + i)};
}
template <class D>
HWY_INLINE Row<D> minus(const Row<D>& a, const Row<D>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE RowD times(VD s, const RowD& a) {
  return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
template <class V>
HWY_INLINE V dot(V ax, V ay, V az, V bx, V by, V bz) {
  return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
}
HWY_INLINE VD dot(const RowD& a, const RowD& b) { return dot(a.x, a.y, a.z, b.x, b.y, b.z); }
template <class D>
HWY_INLINE Row<D> cross(const Row<D>& a, const Row<D>& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
HWY_INLINE VD length(const RowD& a) { return hn::Sqrt(dot(a, a)); }
template <class Mask>
HWY_INLINE RowD choose(Mask m, const RowD& a, const RowD& b) {
  return {hn::IfThenElse(m, a.x, b.x), hn::IfThenElse(m, a.y, b.y), hn::IfThenElse(m, a.z, b.z)};
}

HWY_INLINE void put(float* to, VD a) {
  const hn::Rebind<float, Wide> d;
  hn::Store(hn::DemoteTo(d, a), d, to);
}
HWY_INLINE void put(float (&to)[3][8], std::size_t i, const RowD& a) {
  put(to[0] + i, a.x);
  put(to[1] + i, a.y);
  put(to[2] + i, a.z);
}

// Unit, across a.
RowD any_normal(const RowD& a) {
  const Wide d;
  const VD zero = hn::Zero(d), x = hn::Abs(a.x), y = hn::Abs(a.y), z = hn::Abs(a.z);
  const auto by_x = hn::And(hn::Le(x, y), hn::Le(x, z));
  const RowD n =
      choose(by_x, RowD{zero, hn::Neg(a.z), a.y},
             choose(hn::Le(y, z), RowD{a.z, zero, hn::Neg(a.x)}, RowD{hn::Neg(a.y), a.x, zero}));
  return times(hn::Div(hn::Set(d, 1.0), length(n)), n);
}

// Triangles i and up; `normal` is twice as long as the area.
HWY_INLINE void set_triangles(const LeafCorners& corners, std::size_t i, EightTriangles& t,
                              float (&normal)[3][8]) {
  constexpr double kFlat = 1e-6, kSliver = 1e-2;
  constexpr double kDigits = 4e-6;  // thirty times the rounding of a float
  const Wide d;
  const VD zero = hn::Zero(d), one = hn::Set(d, 1.0), half = hn::Set(d, 0.5);
  const RowD a = load(d, corners.at[0], i), b = load(d, corners.at[1], i),
             c = load(d, corners.at[2], i);
  const RowD ab = minus(b, a), bc = minus(c, b), ca = minus(a, c);
  const VD size_ab = length(ab), size_bc = length(bc), size_ca = length(ca);
  // The longest edge comes first: its direction is the most precise.
  const auto second_longest = hn::Gt(size_bc, size_ab);
  const auto third_longest = hn::Gt(size_ca, hn::Max(size_ab, size_bc));
  const auto of_longest = [&](const auto& x, const auto& y, const auto& z) HWY_ATTR {
    return choose(third_longest, z, choose(second_longest, y, x));
  };
  const auto size_of = [&](VD x, VD y, VD z) HWY_ATTR {
    return hn::IfThenElse(third_longest, z, hn::IfThenElse(second_longest, y, x));
  };
  const RowD edge = of_longest(ab, bc, ca), next = of_longest(bc, ca, ab),
             back = of_longest(ca, ab, bc);
  const VD first = size_of(size_ab, size_bc, size_ca), second = size_of(size_bc, size_ca, size_ab),
           third = size_of(size_ca, size_ab, size_bc);
  put(t.a, i, of_longest(a, b, c));
  const auto point = hn::Le(first, hn::Set(d, 1e-9));
  const VD by_first = hn::IfThenZeroElse(point, hn::Div(one, first));
  const RowD x = choose(point, RowD{one, zero, zero}, times(by_first, edge));
  const RowD n = cross(edge, next);
  const VD area2 = length(n), height = hn::Mul(area2, by_first);
  put(normal, i, n);
  const auto flat = hn::Not(hn::Gt(height, hn::Set(d, kFlat)));
  RowD z = times(hn::Div(one, area2), n);
  if (HWY_UNLIKELY(!hn::AllFalse(d, flat))) z = choose(flat, any_normal(x), z);
  put(t.frame[0], i, x);
  put(t.frame[1], i, cross(z, x));
  put(t.frame[2], i, z);
  // A flat triangle becomes its longest edge, three times, without an inside.
  const VD by_second = hn::Div(one, second), by_third = hn::Div(one, third);
  const VD x1 = hn::Mul(dot(next, x), by_second), y1 = hn::Mul(height, by_second);
  put(t.along1[0] + i, hn::IfThenElse(flat, one, x1));
  put(t.along1[1] + i, hn::IfThenZeroElse(flat, y1));
  put(t.along2[0] + i, hn::IfThenElse(flat, hn::Neg(one), hn::Mul(dot(back, x), by_third)));
  put(t.along2[1] + i, hn::IfThenZeroElse(flat, hn::Neg(hn::Mul(height, by_third))));
  const VD half_first = hn::Mul(first, half), half_second = hn::Mul(second, half);
  put(t.half[0] + i, half_first);
  put(t.half[1] + i, hn::IfThenElse(flat, half_first, half_second));
  put(t.half[2] + i, hn::IfThenElse(flat, half_first, hn::Mul(third, half)));
  put(t.from1 + i, hn::Neg(hn::IfThenElse(flat, half_first, hn::MulAdd(x1, first, half_second))));
  put(t.off1 + i, hn::IfThenZeroElse(flat, hn::Mul(y1, first)));
  put(t.longest2 + i, hn::Mul(first, first));
  const auto sliver = hn::AndNot(flat, hn::Lt(height, hn::Mul(hn::Set(d, kSliver), first)));
  const VD within = hn::Div(area2, hn::Add(first, hn::Add(second, third)));
  put(t.width2 + i, hn::IfThenElseZero(sliver, hn::Mul(within, within)));
  put(t.inside + i, hn::IfThenElse(hn::Or(flat, sliver), hn::Set(d, -1e30), hn::Set(d, kDigits)));
}

constexpr std::size_t kVectors = 8 / hn::MaxLanes(Narrow());

// Ends of eight triangles along an axis, in float, from their first corners.
struct Corners {
  RowF a[kVectors], ab[kVectors], ac[kVectors];
};
HWY_INLINE void reach_along(const Corners& t, const float (&n)[3], float& low, float& high) {
  const Narrow d;
  const auto x = hn::Set(d, n[0]), y = hn::Set(d, n[1]), z = hn::Set(d, n[2]), zero = hn::Zero(d);
  auto least = hn::Set(d, 1e30f), most = hn::Neg(least);
  for (std::size_t i = 0; i < kVectors; ++i) {
    const auto a = dot(x, y, z, t.a[i].x, t.a[i].y, t.a[i].z);
    const auto b = dot(x, y, z, t.ab[i].x, t.ab[i].y, t.ab[i].z);
    const auto c = dot(x, y, z, t.ac[i].x, t.ac[i].y, t.ac[i].z);
    least = hn::Min(least, hn::Add(a, hn::Min(hn::Min(b, c), zero)));
    most = hn::Max(most, hn::Add(a, hn::Max(hn::Max(b, c), zero)));
  }
  low = hn::GetLane(hn::MinOfLanes(d, least));
  high = hn::GetLane(hn::MaxOfLanes(d, most));
}

// The sum of normals, each twice as long as its area and turned to the side of `to`.
HWY_INLINE void mean_normal(const float (&normals)[3][8], const float (&to)[3], float (&mean)[3]) {
  const Narrow d;
  const auto tx = hn::Set(d, to[0]), ty = hn::Set(d, to[1]), tz = hn::Set(d, to[2]);
  auto x = hn::Zero(d), y = x, z = x;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const RowF n = load(d, normals, i);
    const auto along = dot(tx, ty, tz, n.x, n.y, n.z);
    x = hn::Add(x, hn::CopySign(n.x, hn::Xor(n.x, along)));
    y = hn::Add(y, hn::CopySign(n.y, hn::Xor(n.y, along)));
    z = hn::Add(z, hn::CopySign(n.z, hn::Xor(n.z, along)));
  }
  mean[0] = hn::GetLane(hn::SumOfLanes(d, x));
  mean[1] = hn::GetLane(hn::SumOfLanes(d, y));
  mean[2] = hn::GetLane(hn::SumOfLanes(d, z));
}

void SetLeaf(const LeafCorners& corners, EightTriangles& triangles, EightTurnedBoxes& turned,
             EightBoxes& boxes, std::size_t box) {
  const Wide dw;
  const Narrow d;
  alignas(32) float normals[3][8];
  alignas(32) float first[3][8], second[3][8], third[3][8];
  for (std::size_t i = 0; i < 8; i += hn::Lanes(dw)) {
    set_triangles(corners, i, triangles, normals);
    put(first, i, load(dw, corners.at[0], i));
    put(second, i, load(dw, corners.at[1], i));
    put(third, i, load(dw, corners.at[2], i));
  }
  Corners t;
  for (std::size_t i = 0; i < kVectors; ++i) {
    t.a[i] = load(d, first, i * hn::Lanes(d));
    t.ab[i] = minus(load(d, second, i * hn::Lanes(d)), t.a[i]);
    t.ac[i] = minus(load(d, third, i * hn::Lanes(d)), t.a[i]);
  }
  const auto put_turned = [&](const float(&axis)[3][3], const float* low, const float* high) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 3; ++c) turned.axis[k][c][box] = axis[k][c];
      turned.middle[k][box] = (low[k] + high[k]) / 2;
      turned.half[k][box] = (high[k] - low[k]) / 2 + kTurnedMargin;
    }
  };
  const auto size = [](const float* low, const float* high) {
    float product = 1;
    for (std::size_t k = 0; k < 3; ++k) product *= high[k] - low[k] + 1;
    return product;
  };
  float low[3], high[3], turned_low[3], turned_high[3];
  for (std::size_t k = 0; k < 3; ++k) {
    auto least = hn::Set(d, 1e30f), most = hn::Neg(least);
    for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
      const auto a = hn::Load(d, first[k] + i), b = hn::Load(d, second[k] + i),
                 c = hn::Load(d, third[k] + i);
      least = hn::Min(least, hn::Min(a, hn::Min(b, c)));
      most = hn::Max(most, hn::Max(a, hn::Max(b, c)));
    }
    low[k] = hn::GetLane(hn::MinOfLanes(d, least));
    high[k] = hn::GetLane(hn::MaxOfLanes(d, most));
    boxes.low[k][box] = low[k] - kBoxMargin;
    boxes.high[k][box] = high[k] + kBoxMargin;
  }
  float of_first[3] = {normals[0][0], normals[1][0], normals[2][0]}, sum[3], normal[3];
  mean_normal(normals, of_first, sum);
  mean_normal(normals, sum, normal);
  const float length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
  if (length2 > 1e-12f) {
    const float by_length = 1 / std::sqrt(length2);
    for (float& c : normal) c *= by_length;
    std::size_t least = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (std::fabs(normal[k]) < std::fabs(normal[least])) least = k;
    const std::size_t l1 = (least + 1) % 3, l2 = (least + 2) % 3;
    const float by_across = 1 / std::sqrt(normal[l1] * normal[l1] + normal[l2] * normal[l2]);
    float axis[3][3] = {{normal[0], normal[1], normal[2]}, {0, 0, 0}, {0, 0, 0}};
    axis[1][l1] = -normal[l2] * by_across;
    axis[1][l2] = normal[l1] * by_across;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      axis[2][k] = axis[0][k1] * axis[1][k2] - axis[0][k2] * axis[1][k1];
    }
    for (std::size_t k = 0; k < 3; ++k) reach_along(t, axis[k], turned_low[k], turned_high[k]);
    if (size(turned_low, turned_high) < size(low, high)) {
      put_turned(axis, turned_low, turned_high);
      return;
    }
  }
  put_turned({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, low, high);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(SetLeaf);

void set_leaf(const LeafCorners& corners, EightTriangles& triangles, EightTurnedBoxes& turned,
              EightBoxes& boxes, std::size_t box) {
  HWY_DYNAMIC_DISPATCH(SetLeaf)(corners, triangles, turned, boxes, box);
}

}  // namespace h6::kernels
#endif
