// SPDX-License-Identifier: Apache-2.0
// gauss_tree_sum.cpp - densities at the contacts of a leaf, from the nodes of the tree.
//
// The tree is walked once for the 16 targets of a leaf, or of several leaves that are near each
// other, 16 sibling nodes at a time. A node that no target reaches is dropped. A node inside the
// supports of all targets joins one polynomial about the targets' centre. Other nodes are opened,
// or listed whole where they are small and contacts many. In an opened leaf each contact is
// dropped, joins the polynomial, or goes to a list that every target sums pair by pair.
#include "kernels/weights/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_tree_sum.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/tail-inl.h"
#include "kernels/weights/gauss_targets-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// ---- the walk

// Opens the collected leaves. Sums and counts stay in registers: a leaf takes less time than a
// store and load between it and the next.
template <int kAxes, Form kForm>
HWY_NOINLINE void open_leaves(Targets<kAxes>& t) {
  constexpr int kSpheres = kAxes / 3;
  const DF d;
  VF centre[kAxes], width2[kSpheres], far2[kSpheres], in2[kSpheres], term[5];
  for (int k = 0; k < kAxes; ++k) centre[k] = hn::Set(d, t.centre[k]);
  for (int s = 0; s < kSpheres; ++s) {
    const float far = t.g.width[s] + t.radius[s], in = t.g.width[s] - t.radius[s];
    width2[s] = hn::Set(d, t.width2[s]);
    far2[s] = hn::Set(d, far * far);
    in2[s] = hn::Set(d, in > 0 ? in * in : -1.0f);
  }
  for (int k = 0; k < 5; ++k) term[k] = t.term[k];
  const float* const leaves = t.g.leaves;
  std::size_t count = t.list.count;
  for (std::size_t c = 0; c < t.cuts; ++c) {
    const float* const leaf = leaves + t.cut[c] * (kAxes + 1) * kGaussLeaf;
    for (std::size_t p = 0; p < kGaussLeaf; p += kLanes) {
      const float* const column = leaf + p;
      const VF share = hn::Load(d, column + kAxes * kGaussLeaf);
      VF away[kAxes], gap[kSpheres];
      MF near = hn::Gt(share, hn::Zero(d)), inside = near;
      HWY_UNROLL(2)
      for (int s = 0; s < kSpheres; ++s) {
        for (int k = 3 * s; k < 3 * s + 3; ++k)
          away[k] = hn::Sub(hn::Load(d, column + k * kGaussLeaf), centre[k]);
        const VF gap2 = norm2_of(away + 3 * s);
        near = hn::And(near, hn::Lt(gap2, far2[s]));
        inside = hn::And(inside, hn::Le(gap2, in2[s]));
        gap[s] = hn::Sub(width2[s], gap2);
      }
      if constexpr (kAxes == 3) {
        join(term, hn::IfThenElseZero(inside, share), hn::Zero(d), away, gap[0]);
      } else if (!hn::AllFalse(d, inside)) {
        join_contacts(hn::IfThenElseZero(inside, share), away, gap, t.term);
      }
      const MF cut = hn::AndNot(inside, near);
      const auto append = [&](int k, VF v) HWY_ATTR {
        hn::StoreU(compress(d, v, cut), d, t.list.column[k] + count);
      };
      if constexpr (kForm == Form::flat) {
        append(0, share);
        for (int k = 0; k < 2; ++k) append(1 + k, along(away, t.tangent[k]));
        append(3, gap[0]);
      } else {
        append(0, share);
        HWY_UNROLL(2)
        for (int s = 0; s < kSpheres; ++s) {
          VF factor = hn::Set(d, 2.0f), rest = gap[s];
          if (s == 0) factor = hn::Mul(factor, share), rest = hn::Mul(rest, share);
          for (int k = 0; k < 3; ++k)
            append(1 + 4 * s + k, kForm == Form::products
                                      ? hn::Mul(factor, away[3 * s + k])
                                      : hn::Load(d, column + (3 * s + k) * kGaussLeaf));
          if (kForm == Form::products) append(4 + 4 * s, rest);
        }
      }
      count += hn::CountTrue(d, cut);
    }
    if (count + kGaussLeaf > kListed) {
      t.list.count = count;
      work_off(t);
      count = 0;
    }
  }
  if constexpr (kAxes == 3)
    for (int k = 0; k < 5; ++k) t.term[k] = term[k];
  t.list.count = count;
  t.cuts = 0;
}

template <int kAxes>
HWY_INLINE void open(Targets<kAxes>& t) {
  if (kAxes == 3 && t.form == Form::flat) {
    open_leaves<kAxes, kAxes == 3 ? Form::flat : Form::products>(t);
  } else if (t.form == Form::products) {
    open_leaves<kAxes, Form::products>(t);
  } else {
    open_leaves<kAxes, Form::differences>(t);
  }
}

// Lists small nodes whole, each with the mean of e^2 - |V_j - V|^2 over its contacts.
HWY_INLINE void list_nodes(Targets<3>& t, MF some, VF mass, VF a2, const VF* away, VF gap) {
  const DF d;
  const auto append = [&](int k, VF v) HWY_ATTR {
    hn::StoreU(compress(d, v, some), d, t.list.column[k] + t.list.count);
  };
  append(0, mass);
  if (t.form == Form::flat) {
    for (int k = 0; k < 2; ++k) append(1 + k, hn::Mul(mass, along(away, t.tangent[k])));
  } else {
    for (int k = 0; k < 3; ++k) append(1 + k, twice(hn::Mul(mass, away[k])));
  }
  append(t.form == Form::flat ? 3 : 4, hn::MulSub(mass, gap, a2));
  t.list.count += hn::CountTrue(d, some);
}

// Handles sixteen siblings of a level and returns the ones to open, a bit each. With kSmall, small
// nodes are listed whole.
template <int kAxes, bool kSmall>
HWY_INLINE unsigned look_at(Targets<kAxes>& t, const GaussLevel& level, std::size_t block,
                            VF* term) {
  const DF d;
  unsigned open = 0;
  for (std::size_t p = 0; p < kGaussLeaf; p += kLanes) {
    const std::size_t first = block * kGaussLeaf + p;
    const VF mass = hn::Load(d, level.moment[kMass] + first);
    VF away[kAxes], gap[kAxes / 3];
    MF near = hn::Gt(mass, hn::Zero(d)), inside = near;
    for (int s = 0; s < kAxes / 3; ++s) {
      for (int k = 3 * s; k < 3 * s + 3; ++k)
        away[k] = hn::Add(hn::Sub(hn::Load(d, level.centre[k] + first), hn::Set(d, t.centre[k])),
                          hn::Load(d, level.rest[k] + first));
      const VF gap2 = norm2_of(away + 3 * s), width = hn::Set(d, t.g.width[s]);
      const VF size = hn::Add(hn::Load(d, level.radius[s] + first), hn::Set(d, t.radius[s]));
      const VF far = hn::Add(width, size), in = hn::Max(hn::Sub(width, size), hn::Zero(d));
      near = hn::And(near, hn::Lt(gap2, hn::Mul(far, far)));
      inside = hn::And(inside, hn::And(hn::Le(gap2, hn::Mul(in, in)), hn::Gt(in, hn::Zero(d))));
      gap[s] = hn::Sub(hn::Set(d, t.width2[s]), gap2);
    }
    MF cut = hn::AndNot(inside, near);
    if constexpr (kSmall) {
      const VF most = hn::Set(d, kSmallNode * t.g.width[0]);
      const MF small = hn::And(cut, hn::Lt(hn::Load(d, level.radius[0] + first), most));
      if (!hn::AllFalse(d, small)) {
        list_nodes(t, small, mass, hn::Load(d, level.moment[kA2] + first), away, gap[0]);
        cut = hn::AndNot(small, cut);
      }
    }
    open |= bits_of(cut) << p;
    if (hn::AllFalse(d, inside)) continue;
    if constexpr (kAxes == 3) {
      join(term, hn::IfThenElseZero(inside, mass),
           hn::IfThenElseZero(inside, hn::Load(d, level.moment[kA2] + first)), away, gap[0]);
    } else {
      join_nodes(level, first, inside, away, gap, term);
    }
  }
  return open;
}

// Visits the children of the nodes of `block`, a block of level l + 1, whose bits are set.
template <int kAxes, bool kSmall>
void visit(Targets<kAxes>& t, int l, std::size_t block, unsigned nodes) {
  unsigned below[kGaussLeaf];
  VF term[kAxes == 3 ? 5 : 1];
  if constexpr (kAxes == 3)
    for (int k = 0; k < 5; ++k) term[k] = t.term[k];
  VF* const terms = kAxes == 3 ? term : t.term;
  std::size_t count = 0;
  for (unsigned left = nodes; left != 0; left &= left - 1) {
    const std::size_t child = block * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    below[count++] = look_at<kAxes, kSmall>(t, t.g.level[l], child, terms);
    if constexpr (kSmall)
      if (t.list.count > kListed) work_off(t);
  }
  if constexpr (kAxes == 3)
    for (int k = 0; k < 5; ++k) t.term[k] = term[k];
  count = 0;
  for (unsigned left = nodes; left != 0; left &= left - 1) {
    const std::size_t child = block * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    unsigned cut = below[count++];
    if (cut == 0) continue;
    if (l > 0) {
      visit<kAxes, kSmall>(t, l - 1, child, cut);
      continue;
    }
    for (; cut != 0; cut &= cut - 1)
      t.cut[t.cuts++] =
          static_cast<std::uint32_t>(child * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(cut));
    if (t.cuts > kOpened) open(t);
  }
}

// The polynomial at the targets of lanes p and up.
template <int kAxes>
HWY_INLINE VF density_of(const Targets<kAxes>& t, const float* term, std::size_t p) {
  const DF d;
  VF at[kAxes], at2[kAxes / 3];
  for (int k = 0; k < kAxes; ++k) at[k] = hn::Sub(hn::Load(d, t.at(k, p)), hn::Set(d, t.centre[k]));
  for (int s = 0; s < kAxes / 3; ++s) at2[s] = norm2_of(at + 3 * s);
  const auto row = [&](const float* c, const VF* x, VF x2) HWY_ATTR {
    VF sum = hn::MulAdd(hn::Set(d, c[4]), x2, hn::Set(d, c[0]));
    for (int k = 0; k < 3; ++k) sum = hn::MulAdd(hn::Set(d, c[1 + k]), x[k], sum);
    return sum;
  };
  if constexpr (kAxes == 3) return row(term, at, at2[0]);
  VF sum = hn::MulAdd(row(term + 20, at + kAxes - 3, at2[kAxes / 3 - 1]), at2[0],
                      row(term, at + kAxes - 3, at2[kAxes / 3 - 1]));
  for (int k = 0; k < 3; ++k)
    sum = hn::MulAdd(row(term + 5 + 5 * k, at + kAxes - 3, at2[kAxes / 3 - 1]), at[k], sum);
  return sum;
}

// The centre of targets is the middle of their bounding box, without targets of share 0: the radius
// about it is smaller than about the centroid.
template <int kAxes>
HWY_INLINE void centre_targets(Targets<kAxes>& t) {
  const DF d;
  const std::size_t rows = t.leaves * kGaussLeaf;
  for (int k = 0; k < kAxes; ++k) {
    VF low = hn::Set(d, 1e30f), high = hn::Set(d, -1e30f);
    for (std::size_t p = 0; p < rows; p += kLanes) {
      const MF real = hn::Gt(hn::Load(d, t.at(kAxes, p)), hn::Zero(d));
      const VF v = hn::Load(d, t.at(k, p));
      low = hn::Min(low, hn::IfThenElse(real, v, low));
      high = hn::Max(high, hn::IfThenElse(real, v, high));
    }
    t.centre[k] =
        0.5f * (hn::GetLane(hn::MinOfLanes(d, low)) + hn::GetLane(hn::MaxOfLanes(d, high)));
  }
  for (int s = 0; s < kAxes / 3; ++s) {
    VF most = hn::Zero(d);
    for (std::size_t p = 0; p < rows; p += kLanes) {
      VF away[3];
      for (int k = 0; k < 3; ++k)
        away[k] = hn::Sub(hn::Load(d, t.at(3 * s + k, p)), hn::Set(d, t.centre[3 * s + k]));
      const MF real = hn::Gt(hn::Load(d, t.at(kAxes, p)), hn::Zero(d));
      most = hn::Max(most, hn::IfThenElseZero(real, norm2_of(away)));
    }
    t.radius[s] = hn::GetLane(hn::MaxOfLanes(d, hn::Sqrt(most))) * 1.00001f;
  }
}

// Whether two leaves are so near each other that one walk serves both.
template <int kAxes>
HWY_INLINE bool together(const GaussDensity& g, std::size_t leaf, std::size_t other) {
  const GaussLevel& leaves = g.level[0];
  if (!(leaves.moment[kMass][leaf] > 0 && leaves.moment[kMass][other] > 0)) return false;
  for (int s = 0; s < kAxes / 3; ++s) {
    float gap2 = 0;
    for (int k = 3 * s; k < 3 * s + 3; ++k) {
      const float gap = leaves.centre[k][leaf] - leaves.centre[k][other];
      gap2 += gap * gap;
    }
    const float reach = kTogether * g.width[s];
    if (!(leaves.radius[s][leaf] < reach && leaves.radius[s][other] < reach &&
          gap2 < reach * reach))
      return false;
  }
  return true;
}

// Densities at the targets of some leaves.
template <int kAxes>
HWY_INLINE void sum_targets(const GaussDensity& g, std::size_t count, std::size_t leaf,
                            std::size_t leaves) {
  const DF d;
  const std::size_t first = leaf * kGaussLeaf, rows = leaves * kGaussLeaf;
  const std::size_t live = HWY_MIN(rows, count - first);
  HWY_ALIGN float phi[kMostLeaves * kGaussLeaf] = {};
  if (leaves > 1 || g.level[0].moment[kMass][leaf] > 0) {
    Targets<kAxes> t(g, leaf, leaves);
    centre_targets(t);
    float unit = 1;
    for (int s = 0; s < kAxes / 3; ++s) {
      t.width2[s] = g.width[s] * g.width[s];
      if (t.radius[s] > g.width[s]) t.form = Form::differences;
      unit /= t.width2[s];
    }
    if constexpr (kAxes == 3)
      if (t.form == Form::products && g.unit && lay_flat(t)) t.form = Form::flat;
    // The top level is one block.
    if (kAxes == 3 && count >= kGaussMany && t.form != Form::differences) {
      visit<kAxes, kAxes == 3>(t, g.levels - 1, 0, 1);
    } else {
      visit<kAxes, false>(t, g.levels - 1, 0, 1);
    }
    open(t);
    work_off(t);
    float term[Targets<kAxes>::kTerms];
    for (int k = 0; k < Targets<kAxes>::kTerms; ++k)
      term[k] = hn::GetLane(hn::SumOfLanes(d, t.term[k]));
    if constexpr (kAxes == 3)
      for (int k = 1; k < 4; ++k) term[k] *= 2;  // join leaves them halved
    for (std::size_t r = 0; r < rows; ++r) {
      VF sum = hn::Load(d, t.sum[r]);
      for (std::size_t p = kLanes; p < kGaussLeaf; p += kLanes)
        sum = hn::Add(sum, hn::Load(d, t.sum[r] + p));
      phi[r] = hn::GetLane(hn::SumOfLanes(d, sum));
    }
    for (std::size_t p = 0; p < rows; p += kLanes) {
      const VF whole = hn::Add(hn::Load(d, phi + p), density_of(t, term, p));
      hn::Store(hn::Mul(whole, hn::Set(d, unit)), d, phi + p);
    }
  }
  for (std::size_t r = 0; r < live; ++r) g.phi[g.source[first + r]] = phi[r];
}

template <int kAxes>
HWY_INLINE void sum_slice(const GaussDensity& g, std::size_t count, std::size_t begin,
                          std::size_t end) {
  for (std::size_t leaf = begin; leaf < end;) {
    std::size_t leaves = 1;
    while (leaves < kMostLeaves && leaf + leaves < end && together<kAxes>(g, leaf, leaf + leaves))
      ++leaves;
    sum_targets<kAxes>(g, count, leaf, leaves);
    leaf += leaves;
  }
}

void sum_leaves(const GaussDensity& g, std::size_t count, std::size_t begin, std::size_t end) {
  g.axes == 3 ? sum_slice<3>(g, count, begin, end) : sum_slice<6>(g, count, begin, end);
}

void weigh_rows(const GaussTree& tree, std::size_t begin, std::size_t end) {
  using DV = hn::ScalableTag<float>;
  const DV d;
  const DirectionsView& c = tree.contacts;
  const auto self = hn::Set(d, tree.densities == 2 ? 2.0f : 1.0f), zero = hn::Zero(d);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t live = end - i;
    auto phi = load_n(d, tree.density[0].phi + i, live);
    if (tree.densities == 2) phi = hn::Add(phi, load_n(d, tree.density[1].phi + i, live));
    const auto facing = c.facing ? load_n(d, c.facing + i, live) : hn::Set(d, 1.0f);
    auto share = hn::Set(d, *tree.per_share);
    if (c.depth != nullptr) share = hn::Mul(share, load_n(d, c.depth + i, live));
    if (c.facing != nullptr) share = hn::Mul(share, facing);
    // A density is at least the contact's own share, in spite of rounding.
    const auto own = hn::Mul(share, self);
    const auto weight = hn::Div(hn::Mul(facing, own), hn::Max(phi, own));
    store_n(hn::IfThenElseZero(hn::Gt(own, zero), weight), d, tree.weight + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sum_leaves);
HWY_EXPORT(weigh_rows);

void gauss_sum_leaves(const GaussDensity& g, std::size_t count, std::size_t begin,
                      std::size_t end) {
  HWY_DYNAMIC_DISPATCH(sum_leaves)(g, count, begin, end);
}
void gauss_weigh_rows(const GaussTree& tree, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(weigh_rows)(tree, begin, end);
}

}  // namespace h6::kernels
#endif
