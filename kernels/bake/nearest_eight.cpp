// SPDX-License-Identifier: Apache-2.0
// nearest_eight.cpp - the fast twins of nearest_eight_ref.cpp.
#include "kernels/bake/nearest_eight.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/nearest_eight.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "kernels/compress-inl.h"

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
HWY_INLINE VF dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

// Stores lanes i and up, and returns which are below `most`.
HWY_INLINE std::uint32_t keep(VF found, float most, std::size_t i, float* squared) {
  const D d;
  hn::StoreU(found, d, squared + i);
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, hn::Lt(found, hn::Set(d, most)), bits);
  return std::uint32_t{bits[0]} << i;
}

// Lower bounds of the squared distances of triangles i and up. In the frame of a triangle the
// square is h^2 over its inside, else h^2 + min over edges (off^2 + beyond^2), where beyond is the
// distance past the ends of the edge. A point that may be over the inside counts as over it, which
// is safe: h is never more than the distance. Rounding hides the inside of a sliver; there the foot
// of a point over it is at most the inradius away from an edge. `slack`: the most that rounding
// changes the square.
HWY_INLINE VF triangles_from(const EightTriangles& t, const V3& at, std::size_t i, VF& slack) {
  constexpr float kDigits = 4e-6f;
  const D d;
  const VF zero = hn::Zero(d);
  const V3 q = sub(at, load(t.a, i));
  const VF x = dot(load(t.frame[0], i), q), y = dot(load(t.frame[1], i), q),
           h = dot(load(t.frame[2], i), q);
  const VF x1 = hn::Load(d, t.along1[0] + i), y1 = hn::Load(d, t.along1[1] + i);
  const VF x2 = hn::Load(d, t.along2[0] + i), y2 = hn::Load(d, t.along2[1] + i);
  const VF half0 = hn::Load(d, t.half[0] + i), half2 = hn::Load(d, t.half[2] + i);
  const VF from0 = hn::Sub(x, half0);
  const VF from1 = hn::MulAdd(x1, x, hn::MulAdd(y1, y, hn::Load(d, t.from1 + i)));
  const VF from2 = hn::MulAdd(x2, x, hn::MulAdd(y2, y, half2));
  const VF off1 = hn::NegMulAdd(y1, x, hn::MulAdd(x1, y, hn::Load(d, t.off1 + i)));
  const VF off2 = hn::NegMulAdd(y2, x, hn::Mul(x2, y));
  const auto edge = [&](VF from, VF half, VF off) HWY_ATTR {
    const VF beyond = hn::Max(hn::Sub(hn::Abs(from), half), zero);
    return hn::MulAdd(beyond, beyond, hn::Mul(off, off));
  };
  const VF beside =
      hn::Min(hn::Min(edge(from0, half0, y), edge(from1, hn::Load(d, t.half[1] + i), off1)),
              edge(from2, half2, off2));
  const VF inner = hn::Min(hn::Min(y, off1), off2);
  const VF longest2 = hn::Load(d, t.longest2 + i);
  // At least |q| plus the longest edge, without a root.
  const VF size =
      hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Add(hn::Abs(h), hn::Add(half0, half0)));
  const VF least = hn::Mul(hn::Neg(hn::Load(d, t.inside + i)), size);
  const VF flat =
      hn::IfThenZeroElse(hn::Ge(inner, least), hn::Sub(beside, hn::Load(d, t.width2 + i)));
  slack = hn::Mul(hn::Set(d, kDigits), hn::Add(dot(q, q), longest2));
  return hn::Max(hn::Sub(hn::MulAdd(h, h, flat), slack), zero);
}

std::uint32_t Triangles(const EightTriangles& triangles, const float* p, float most,
                        float* squared) {
  const D d;
  const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  std::uint32_t below = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    VF slack;
    below |= keep(triangles_from(triangles, at, i, slack), most, i, squared);
  }
  return below;
}

HWY_INLINE VF boxes_from(const EightBoxes& boxes, const V3& at, std::size_t i) {
  const D d;
  const VF zero = hn::Zero(d);
  const VF p[3] = {at.x, at.y, at.z};
  VF sum = zero;
  for (int k = 0; k < 3; ++k) {
    const VF gap = hn::Max(hn::Max(hn::Sub(hn::Load(d, boxes.low[k] + i), p[k]),
                                   hn::Sub(p[k], hn::Load(d, boxes.high[k] + i))),
                           zero);
    sum = hn::MulAdd(gap, gap, sum);
  }
  return hn::Mul(sum, hn::Set(d, 1 - 1e-6f));
}

HWY_INLINE VF turned_boxes_from(const EightTurnedBoxes& boxes, const V3& at, std::size_t i) {
  const D d;
  const VF zero = hn::Zero(d);
  VF sum = zero;
  for (int k = 0; k < 3; ++k) {
    const VF along = hn::Sub(dot(load(boxes.axis[k], i), at), hn::Load(d, boxes.middle[k] + i));
    const VF gap = hn::Max(hn::Sub(hn::Abs(along), hn::Load(d, boxes.half[k] + i)), zero);
    sum = hn::MulAdd(gap, gap, sum);
  }
  return hn::Mul(sum, hn::Set(d, 1 - 2e-6f));
}

std::uint32_t Boxes(const EightBoxes& boxes, const float* p, float most, float* squared) {
  const D d;
  const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  std::uint32_t below = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d))
    below |= keep(boxes_from(boxes, at, i), most, i, squared);
  return below;
}

std::uint32_t TurnedBoxes(const EightTurnedBoxes& boxes, const float* p, float most,
                          float* squared) {
  const D d;
  const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  std::uint32_t below = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d))
    below |= keep(turned_boxes_from(boxes, at, i), most, i, squared);
  return below;
}

HWY_INLINE void weigh(const NearestTree& tree, std::uint32_t leaf, const V3& at,
                      NearestFound& found) {
  const D d;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    VF slack;
    const VF squared = triangles_from(tree.leaf[leaf], at, i, slack);
    const auto nearer = hn::Lt(squared, hn::Set(d, found.squared));
    if (hn::AllFalse(d, nearer)) continue;
    // An upper bound: the slack that was subtracted is added twice. A square of 0 had less slack.
    const VF twice = hn::Add(slack, slack), width2 = hn::Load(d, tree.leaf[leaf].width2 + i);
    alignas(32) float near[8], above[8];
    hn::Store(squared, d, near);
    hn::Store(hn::Add(squared, hn::Add(twice, hn::Add(width2, width2))), d, above);
    for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
      const std::uint32_t place = 8 * leaf + std::uint32_t(i + k);
      if (near[k] < found.squared && place < tree.triangles) found = {near[k], place, above[k]};
    }
  }
}

// Appends the live lanes: first + lane, and its value. Returns their number. Whole vectors are
// stored, since some processors compress slowly into memory.
template <class Mask>
HWY_INLINE std::size_t keep_live(std::uint32_t first, VF squared, Mask live, std::uint32_t* what,
                                 float* bound) {
  const D d;
  const hn::RebindToUnsigned<D> du;
  // Compresses lane numbers and then adds `first`: GCC builds an Iota from a variable lane by lane
  // in memory, and the load that follows has to wait for all of the stores.
  const auto lanes = compress(du, hn::Iota(du, 0), hn::RebindMask(du, live));
  hn::StoreU(hn::Add(lanes, hn::Set(du, first)), du, what);
  hn::StoreU(compress(d, squared, live), d, bound);
  return hn::CountTrue(d, live);
}

// Depth first: the stack has a bound that does not depend on how many nodes are near.
void search_deep(const NearestTree& tree, const V3& at, NearestFound& found) {
  constexpr std::uint32_t kLevel = 28, kNode = (1u << kLevel) - 1;
  constexpr std::size_t kRoom = 8 * NearestTree::kMostLevels + 8;
  const D d;
  alignas(32) float bound[kRoom];
  alignas(32) std::uint32_t what[kRoom];  // level and node
  std::size_t depth = 1;
  bound[0] = -1;
  what[0] = (tree.levels - 1) << kLevel;
  while (depth > 0) {
    --depth;
    if (bound[depth] >= found.squared) continue;
    const std::uint32_t level = what[depth] >> kLevel, node = what[depth] & kNode;
    if (level > 0) {
      const std::uint32_t child = (level - 1) << kLevel | 8 * node;
      for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
        const VF squared = boxes_from(tree.level[level][node], at, i);
        const auto live = hn::Lt(squared, hn::Set(d, found.squared));
        depth += keep_live(child + std::uint32_t(i), squared, live, what + depth, bound + depth);
      }
      continue;
    }
    for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
      const VF squared = turned_boxes_from(tree.around_leaf[node], at, i);
      alignas(32) float near[8];
      alignas(32) std::uint32_t leaf[8];
      const auto live = hn::Lt(squared, hn::Set(d, found.squared));
      const std::size_t count = keep_live(8 * node + std::uint32_t(i), squared, live, leaf, near);
      for (std::size_t k = 0; k < count; ++k)
        if (near[k] < found.squared) weigh(tree, leaf[k], at, found);
    }
  }
}

// Level by level: the start is nearly always the nearest, so the bound is tight from the beginning,
// and a processor works on many nodes at once where a depth-first search would make it wait for
// each. Returns false when there is no room for the nodes of a level.
constexpr std::size_t kWide = 504;
bool search_wide(const NearestTree& tree, const V3& at, NearestFound& found) {
  const D d;
  alignas(32) std::uint32_t list[2][kWide + 8];
  alignas(32) float bound[kWide + 8];
  const std::uint32_t* from = list[0];
  std::uint32_t* to = list[1];
  std::size_t count = 1;
  list[0][0] = 0;
  const VF most = hn::Set(d, found.squared);
  for (std::uint32_t level = tree.levels; level-- > 0;) {
    std::size_t next = 0;
    for (std::size_t k = 0; k < count; ++k) {
      if (next + 8 > kWide) return false;
      for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
        const VF squared = level > 0 ? boxes_from(tree.level[level][from[k]], at, i)
                                     : turned_boxes_from(tree.around_leaf[from[k]], at, i);
        next += keep_live(8 * from[k] + std::uint32_t(i), squared, hn::Lt(squared, most), to + next,
                          bound + next);
      }
    }
    count = next;
    from = to;
    to = from == list[1] ? list[0] : list[1];
  }
  for (std::size_t k = 0; k < count; ++k)
    if (bound[k] < found.squared) weigh(tree, from[k], at, found);
  return true;
}

void Search(const NearestTree& tree, const float* p, const std::uint32_t* start, std::size_t starts,
            float enough, NearestFound* best) {
  const D d;
  const V3 at = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  NearestFound found = *best;
  for (std::size_t i = 0; i < starts && found.squared > enough; ++i)
    weigh(tree, start[i], at, found);
  if (found.squared > enough && (starts == 0 || !search_wide(tree, at, found)))
    search_deep(tree, at, found);
  *best = found;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(Boxes);
HWY_EXPORT(TurnedBoxes);
HWY_EXPORT(Triangles);
HWY_EXPORT(Search);

std::uint32_t eight_boxes(const EightBoxes& boxes, const float p[3], float most, float squared[8]) {
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
void nearest_search(const NearestTree& tree, const float p[3], const std::uint32_t* start,
                    std::size_t starts, float enough, NearestFound* found) {
  HWY_DYNAMIC_DISPATCH(Search)(tree, p, start, starts, enough, found);
}

}  // namespace h6::kernels
#endif
