// nearest_eight.cpp - the fast twins of nearest_eight_ref.cpp.
#include "kernels/nearest_eight.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/nearest_eight.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 8>;
using VF = hn::Vec<D>;

struct V3 {
  VF x, y, z;
};
HWY_INLINE V3 load(const float (&v)[3][8], std::size_t i) {
  const D d;
  return {hn::Load(d, v[0] + i), hn::Load(d, v[1] + i), hn::Load(d, v[2] + i)};
}
HWY_INLINE V3 sub(const V3& a, const V3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V3 cross(const V3& a, const V3& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
HWY_INLINE VF dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

// Stores lanes i ... and tells which are below `most`.
HWY_INLINE std::uint32_t keep(VF found, float most, std::size_t i, float* squared) {
  const D d;
  hn::StoreU(found, d, squared + i);
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, hn::Lt(found, hn::Set(d, most)), bits);
  return std::uint32_t{bits[0]} << i;
}

std::uint32_t Boxes(const EightBoxes& boxes, const float* p, float most, float* squared) {
  const D d;
  std::uint32_t below = 0;
  const VF zero = hn::Zero(d);
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    VF sum = zero;
    for (int k = 0; k < 3; ++k) {
      const VF at = hn::Set(d, p[k]);
      const VF gap = hn::Max(hn::Max(hn::Sub(hn::Load(d, boxes.low[k] + i), at),
                                     hn::Sub(at, hn::Load(d, boxes.high[k] + i))), zero);
      sum = hn::MulAdd(gap, gap, sum);
    }
    below |= keep(hn::Mul(sum, hn::Set(d, 1 - 1e-6f)), most, i, squared);
  }
  return below;
}

std::uint32_t TurnedBoxes(const EightTurnedBoxes& boxes, const float* p, float most,
                          float* squared) {
  const D d;
  std::uint32_t below = 0;
  const VF zero = hn::Zero(d);
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
    VF sum = zero;
    for (int k = 0; k < 3; ++k) {
      const VF along = hn::Sub(dot(load(boxes.axis[k], i), at), hn::Load(d, boxes.middle[k] + i));
      const VF gap = hn::Max(hn::Sub(hn::Abs(along), hn::Load(d, boxes.half[k] + i)), zero);
      sum = hn::MulAdd(gap, gap, sum);
    }
    below |= keep(hn::Mul(sum, hn::Set(d, 1 - 2e-6f)), most, i, squared);
  }
  return below;
}

// To the segment from the origin to e of a point at q.
HWY_INLINE VF to_segment(const V3& q, const V3& e, VF length2) {
  const D d;
  const VF t = hn::Min(hn::Max(hn::Div(dot(q, e), hn::Max(length2, hn::Set(d, 1e-20f))),
                               hn::Zero(d)), hn::Set(d, 1.0f));
  const V3 gap = {hn::NegMulAdd(t, e.x, q.x), hn::NegMulAdd(t, e.y, q.y),
                  hn::NegMulAdd(t, e.z, q.z)};
  return dot(gap, gap);
}

// Over the inside (barycentric v, w, 1 - v - w all positive) the height, else the nearest edge.
// Rounding makes the normal of a long triangle wrong by an angle of |b||c|/area times that of float,
// and the height by that times how far the first corner is; v and w likewise. A point that may be
// over the inside is taken to be: the height is never more than the distance. On a
// sliver, whose inside cannot be told like that, the foot of the height is nowhere farther from an
// edge than the radius of the circle inside, which is twice the area over the girth.
std::uint32_t Triangles(const EightTriangles& triangles, const float* p, float most,
                        float* squared) {
  constexpr float kDigits = 4e-6f, kSliver2 = 1e-4f;
  const D d;
  const VF zero = hn::Zero(d);
  std::uint32_t below = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
    const V3 q = sub(at, load(triangles.a, i)), b = load(triangles.ab, i),
             c = load(triangles.ac, i), bc = sub(c, b);
    const VF bb = dot(b, b), cc = dot(c, c), b_c = dot(b, c), qb = dot(q, b), qc = dot(q, c),
             qq = dot(q, q);
    const VF edges = hn::Min(hn::Min(to_segment(q, b, bb), to_segment(q, c, cc)),
                             to_segment(sub(q, b), bc, dot(bc, bc)));
    const V3 n = cross(b, c);
    const VF area = dot(n, n);
    const VF v = hn::NegMulAdd(b_c, qc, hn::Mul(cc, qb));
    const VF w = hn::NegMulAdd(b_c, qb, hn::Mul(bb, qc));
    const VF longest2 = hn::Max(hn::Max(bb, cc), dot(bc, bc));
    const VF away = hn::Sqrt(qq), longest = hn::Sqrt(longest2), sides = hn::Sqrt(hn::Mul(bb, cc));
    const VF fuzz = hn::Mul(hn::Mul(hn::Set(d, kDigits), hn::Mul(sides, longest)),
                            hn::Add(away, longest));
    const auto inside = hn::And(hn::Ge(hn::Add(hn::Min(v, w), fuzz), zero),
                                hn::Le(hn::Add(v, w), hn::Add(area, fuzz)));
    const VF over = hn::Mul(hn::Set(d, kDigits), hn::Mul(away, sides));
    const VF root = hn::Sqrt(hn::Max(area, hn::Set(d, 1e-20f)));
    const VF high = hn::Max(hn::Div(hn::Sub(hn::Abs(dot(q, n)), over), root), zero);
    const VF height = hn::Mul(high, high);
    // (edge - width)^2 >= edge^2 - 2 edge width
    const VF within = hn::Div(hn::MulAdd(hn::Set(d, kDigits), sides, root),
                              hn::Max(hn::Add(longest, longest), hn::Set(d, 1e-10f)));
    const VF sliver = hn::NegMulAdd(within, within, edges);
    const auto thin = hn::Lt(area, hn::Mul(hn::Set(d, kSliver2), hn::Mul(longest2, longest2)));
    const VF slack = hn::Mul(hn::Set(d, kDigits), hn::Add(qq, longest2));
    const VF beside = hn::Sub(hn::IfThenElse(thin, sliver, edges), slack);
    const VF found = hn::IfThenElse(hn::AndNot(thin, inside), hn::Min(height, beside), beside);
    below |= keep(hn::Max(found, zero), most, i, squared);
  }
  return below;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(Boxes);
HWY_EXPORT(TurnedBoxes);
HWY_EXPORT(Triangles);

std::uint32_t eight_boxes(const EightBoxes& boxes, const float p[3], float most,
                          float squared[8]) {
  return HWY_DYNAMIC_DISPATCH(Boxes)(boxes, p, most, squared);
}
std::uint32_t eight_turned_boxes(const EightTurnedBoxes& boxes, const float p[3], float most,
                                 float squared[8]) {
  return HWY_DYNAMIC_DISPATCH(TurnedBoxes)(boxes, p, most, squared);
}
std::uint32_t eight_triangles(const EightTriangles& triangles, const float p[3], float most,
                              float squared[8]) {
  return HWY_DYNAMIC_DISPATCH(Triangles)(triangles, p, most, squared);
}

}  // namespace h6::kernels
#endif
