// SPDX-License-Identifier: Apache-2.0
// gauss_tree_build.cpp - builds leaves and nodes of the tree: centroids, radii and moments about
// them.
//
// Only differences from a nearby row are squared or summed. A centroid is kept as two floats, so
// that first moments about it vanish.
#include "kernels/weights/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_tree_build.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kGaussLeaf>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kParts = kGaussLeaf / kLanes;  // vectors that hold 16 rows

// Below this total share a weighted centroid is not precise enough.
constexpr float kLeastMass = 1e-34f;
constexpr float kNowhere = 1e15f;  // radius of a node that is always opened

// Sixteen rows.
struct Rows {
  VF part[kParts];
};

HWY_INLINE Rows load_rows(const float* column) {
  Rows r;
  for (std::size_t p = 0; p < kParts; ++p) r.part[p] = hn::Load(DF(), column + p * kLanes);
  return r;
}
HWY_INLINE float sum_of(const Rows& r) {
  VF sum = r.part[0];
  for (std::size_t p = 1; p < kParts; ++p) sum = hn::Add(sum, r.part[p]);
  return hn::GetLane(hn::SumOfLanes(DF(), sum));
}
HWY_INLINE float most_of(const Rows& r) {
  VF most = r.part[0];
  for (std::size_t p = 1; p < kParts; ++p) most = hn::Max(most, r.part[p]);
  return hn::GetLane(hn::MaxOfLanes(DF(), most));
}
template <class F>
HWY_INLINE Rows each(F f) {
  Rows r;
  HWY_UNROLL(16)
  for (std::size_t p = 0; p < kParts; ++p) r.part[p] = f(p);
  return r;
}

// sum of rows a * b
HWY_INLINE float dot(const Rows& a, const Rows& b) {
  return sum_of(each([&](std::size_t p) HWY_ATTR { return hn::Mul(a.part[p], b.part[p]); }));
}
HWY_INLINE Rows times(const Rows& a, const Rows& b) {
  return each([&](std::size_t p) HWY_ATTR { return hn::Mul(a.part[p], b.part[p]); });
}
HWY_INLINE Rows norm2_of(const Rows* v) {
  return each([&](std::size_t p) HWY_ATTR {
    return hn::MulAdd(v[2].part[p], v[2].part[p],
                      hn::MulAdd(v[1].part[p], v[1].part[p], hn::Mul(v[0].part[p], v[0].part[p])));
  });
}

// Turns v, differences from `origin`, into differences from the centroid, and stores the centroid.
HWY_INLINE void centre(const GaussLevel& level, std::size_t node, int axis, float origin,
                       const Rows& share, float per_mass, Rows& v) {
  const float mean = dot(share, v) * per_mass;
  const float at = origin + mean;
  level.centre[axis][node] = at;
  level.rest[axis][node] = mean - (at - origin);
  v = each([&](std::size_t p) HWY_ATTR { return hn::Sub(v.part[p], hn::Set(DF(), mean)); });
}

// Radius over the rows of share > 0, enlarged for rounding.
HWY_INLINE float radius_of(const Rows& share, const Rows& distance) {
  const float most = most_of(each([&](std::size_t p) HWY_ATTR {
    return hn::IfThenElseZero(hn::Gt(share.part[p], hn::Zero(DF())), distance.part[p]);
  }));
  return most * 1.00001f;
}

HWY_INLINE Rows root(const Rows& r) {
  return each([&](std::size_t p) HWY_ATTR { return hn::Sqrt(r.part[p]); });
}

// Makes a node without share, which is far from every target.
HWY_INLINE void clear(const GaussDensity& g, const GaussLevel& level, std::size_t node) {
  for (int k = 0; k < g.axes; ++k) level.centre[k][node] = level.rest[k][node] = 0;
  for (int s = 0; s < g.axes / 3; ++s) level.radius[s][node] = 0;
  for (int k = 0; k < (g.axes == 3 ? 2 : kGaussMoments); ++k) level.moment[k][node] = 0;
}

HWY_INLINE void gather_leaf(const GaussTree& tree, const GaussDensity& g, std::size_t leaf) {
  const hn::RebindToSigned<DF> di;
  const std::size_t first = leaf * kGaussLeaf;
  const std::size_t live = HWY_MIN(kGaussLeaf, tree.contacts.count - first);
  HWY_ALIGN std::int32_t from[kGaussLeaf];
  // Rows past the end repeat the last contact with share 0.
  for (std::size_t r = 0; r < kGaussLeaf; ++r)
    from[r] = static_cast<std::int32_t>(g.source[first + HWY_MIN(r, live - 1)]);
  const float *const facing = tree.contacts.facing, *const depth = tree.contacts.depth;
  float* const share = leaf_column(g, leaf, g.axes);
  for (std::size_t p = 0; p < kGaussLeaf; p += kLanes) {
    const auto row = hn::Load(di, from + p);
    for (int k = 0; k < g.axes; ++k)
      hn::Store(hn::GatherIndex(DF(), g.column[k], row), DF(), leaf_column(g, leaf, k) + p);
    VF s = hn::Set(DF(), *tree.per_share);
    if (depth != nullptr) s = hn::Mul(s, hn::GatherIndex(DF(), depth, row));
    if (facing != nullptr) s = hn::Mul(s, hn::GatherIndex(DF(), facing, row));
    hn::Store(hn::IfThenElseZero(hn::FirstN(DF(), live > p ? live - p : 0), s), DF(), share + p);
  }
}

HWY_INLINE void build_leaf(const GaussDensity& g, std::size_t leaf) {
  const GaussLevel& level = g.level[0];
  const Rows share = load_rows(leaf_column(g, leaf, g.axes));
  const float mass = sum_of(share);
  if (!(mass > 0)) return clear(g, level, leaf);
  const bool light = mass < kLeastMass;
  const float per_mass = light ? 0.0f : 1 / mass;
  Rows v[6], size[2];
  for (int k = 0; k < g.axes; ++k) {
    const float* column = leaf_column(g, leaf, k);
    const float origin = column[0];
    v[k] = load_rows(column);
    v[k] =
        each([&](std::size_t p) HWY_ATTR { return hn::Sub(v[k].part[p], hn::Set(DF(), origin)); });
    centre(level, leaf, k, origin, share, per_mass, v[k]);
  }
  for (int s = 0; s < g.axes / 3; ++s) {
    size[s] = norm2_of(v + 3 * s);
    level.radius[s][leaf] = light ? kNowhere : radius_of(share, root(size[s]));
  }
  level.moment[kMass][leaf] = mass;
  const Rows share_a2 = times(share, size[0]);
  level.moment[kA2][leaf] = sum_of(share_a2);
  if (g.axes == 3) return;
  const Rows share_b2 = times(share, size[1]);
  level.moment[kB2][leaf] = sum_of(share_b2);
  level.moment[kA2B2][leaf] = dot(share_a2, size[1]);
  for (int k = 0; k < 3; ++k) {
    level.moment[kAB2 + k][leaf] = dot(share_b2, v[k]);
    level.moment[kBA2 + k][leaf] = dot(share_a2, v[3 + k]);
    const Rows share_a = times(share, v[k]);
    for (int l = 0; l < 3; ++l) level.moment[kAB + 3 * k + l][leaf] = dot(share_a, v[3 + l]);
  }
}

void build_leaves(const GaussTree& tree, const GaussDensity& g, std::size_t begin,
                  std::size_t end) {
  for (std::size_t leaf = begin; leaf < end; ++leaf) {
    gather_leaf(tree, g, leaf);
    build_leaf(g, leaf);
  }
}

// Moments of 16 children about a common centre that is p, q away from theirs.
HWY_INLINE void shift_moments(const GaussLevel& child, const GaussLevel& level, std::size_t node,
                              const Rows* p, const Rows& p2, const Rows* q, const Rows& q2) {
  const std::size_t first = node * kGaussLeaf;
  const auto moment = [&](int k) HWY_ATTR { return load_rows(child.moment[k] + first); };
  const Rows mass = moment(kMass), a2 = moment(kA2), b2 = moment(kB2);
  const Rows moved_b2 = each(
      [&](std::size_t i) HWY_ATTR { return hn::MulAdd(mass.part[i], q2.part[i], b2.part[i]); });
  const Rows moved_a2 = each(
      [&](std::size_t i) HWY_ATTR { return hn::MulAdd(mass.part[i], p2.part[i], a2.part[i]); });
  level.moment[kB2][node] = sum_of(moved_b2);
  Rows ab[3][3], ab2[3], ba2[3];
  for (int k = 0; k < 3; ++k) {
    ab2[k] = moment(kAB2 + k);
    ba2[k] = moment(kBA2 + k);
    for (int l = 0; l < 3; ++l) ab[k][l] = moment(kAB + 3 * k + l);
  }
  // sum s |a + p|^2 |b + q|^2
  Rows whole = each([&](std::size_t i) HWY_ATTR {
    return hn::MulAdd(p2.part[i], moved_b2.part[i], hn::Mul(q2.part[i], a2.part[i]));
  });
  const Rows old = moment(kA2B2);
  float total = sum_of(whole) + sum_of(old);
  for (int k = 0; k < 3; ++k) {
    const Rows ab_q = each([&](std::size_t i) HWY_ATTR {
      return hn::MulAdd(
          ab[k][0].part[i], q[0].part[i],
          hn::MulAdd(ab[k][1].part[i], q[1].part[i], hn::Mul(ab[k][2].part[i], q[2].part[i])));
    });
    const Rows ba_p = each([&](std::size_t i) HWY_ATTR {
      return hn::MulAdd(
          ab[0][k].part[i], p[0].part[i],
          hn::MulAdd(ab[1][k].part[i], p[1].part[i], hn::Mul(ab[2][k].part[i], p[2].part[i])));
    });
    total += 2 * dot(q[k], ba2[k]) + 2 * dot(p[k], ab2[k]) + 4 * dot(p[k], ab_q);
    level.moment[kAB2 + k][node] = sum_of(ab2[k]) + 2 * sum_of(ab_q) + dot(p[k], moved_b2);
    level.moment[kBA2 + k][node] = sum_of(ba2[k]) + 2 * sum_of(ba_p) + dot(q[k], moved_a2);
    const Rows mass_p = times(mass, p[k]);
    for (int l = 0; l < 3; ++l)
      level.moment[kAB + 3 * k + l][node] = sum_of(ab[k][l]) + dot(mass_p, q[l]);
  }
  level.moment[kA2B2][node] = total;
}

HWY_INLINE void build_node(const GaussDensity& g, const GaussLevel& child, const GaussLevel& level,
                           std::size_t node) {
  const std::size_t first = node * kGaussLeaf;
  const Rows mass = load_rows(child.moment[kMass] + first);
  const float sum = sum_of(mass);
  if (!(sum > 0)) return clear(g, level, node);
  // The heaviest child has a share.
  std::size_t from = first;
  for (std::size_t k = first; k < first + kGaussLeaf; ++k)
    if (child.moment[kMass][k] > child.moment[kMass][from]) from = k;
  const float per_mass = sum < kLeastMass ? 0.0f : 1 / sum;
  Rows v[6], size[2];
  for (int k = 0; k < g.axes; ++k) {
    const float at = child.centre[k][from];
    const Rows hi = load_rows(child.centre[k] + first), lo = load_rows(child.rest[k] + first);
    v[k] = each([&](std::size_t p) HWY_ATTR {
      return hn::Add(hn::Sub(hi.part[p], hn::Set(DF(), at)), lo.part[p]);
    });
    centre(level, node, k, at, mass, per_mass, v[k]);
  }
  for (int s = 0; s < g.axes / 3; ++s) {
    size[s] = norm2_of(v + 3 * s);
    const Rows away = root(size[s]), own = load_rows(child.radius[s] + first);
    level.radius[s][node] = radius_of(
        mass, each([&](std::size_t p) HWY_ATTR { return hn::Add(away.part[p], own.part[p]); }));
  }
  level.moment[kMass][node] = sum;
  level.moment[kA2][node] = sum_of(load_rows(child.moment[kA2] + first)) + dot(mass, size[0]);
  if (g.axes == 6) shift_moments(child, level, node, v, size[0], v + 3, size[1]);
}

void build_levels(const GaussDensity& g) {
  for (int l = 0; l < g.levels; ++l) {
    const GaussLevel& level = g.level[l];
    if (l > 0)
      for (std::size_t node = 0; node < level.count; ++node)
        build_node(g, g.level[l - 1], level, node);
    for (std::size_t node = level.count; node % kGaussLeaf != 0; ++node) clear(g, level, node);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(build_leaves);
HWY_EXPORT(build_levels);

void gauss_build_leaves(const GaussTree& tree, const GaussDensity& g, std::size_t begin,
                        std::size_t end) {
  HWY_DYNAMIC_DISPATCH(build_leaves)(tree, g, begin, end);
}
void gauss_build_levels(const GaussDensity& g) { HWY_DYNAMIC_DISPATCH(build_levels)(g); }

}  // namespace h6::kernels
#endif
