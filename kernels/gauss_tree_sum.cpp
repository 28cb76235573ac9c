// gauss_tree_sum.cpp - densities at the contacts of a leaf, from the nodes of the tree.
//
// For the 16 targets of a leaf, or of two that are near, the tree is walked once, 16 sibling nodes
// at a time. Nodes that none of the targets reaches are dropped; those that all of them hold inside
// their supports become one polynomial about the targets' centre; the rest is opened. So are
// leaves: contacts in them are dropped, join the polynomial, or go to a list that every target sums
// pair by pair.
#include <cstring>

#include "kernels/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/gauss_tree_sum.cpp"
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
using MF = hn::Mask<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kListed = 512;    // contacts before a list is worked off
constexpr std::size_t kMostLeaves = 2;  // of targets
constexpr float kTogether = 0.1f;       // of a width: leaves that share a walk, and how far apart
constexpr std::size_t kOpened = 256;    // leaves before they are opened

// Pairs in the form c + 2 t.x, with x and t from the targets' centre: exact enough while targets
// are no farther from it than a width. Else by differences.
enum class Form { products, differences };

// Columns of listed contacts. Over each sphere, form products: 2 x and e^2 - |x|^2, the first
// sphere's times the share; form differences: x, the share first. Where all shares are 1, form
// products has no share, and x in the place of 2 x.
template <int kAxes>
struct List {
  static constexpr int kShare = 0, kFirst = 1;  // then 4 a sphere: x y z, rest
  HWY_ALIGN float column[1 + 4 * kAxes / 3][kListed + 2 * kGaussLeaf];
  std::size_t count = 0;
};

// Targets of a leaf, or of two in a row.
template <int kAxes>
struct Targets {
  static constexpr int kSpheres = kAxes / 3;
  static constexpr int kTerms = kAxes == 3 ? 5 : 25;
  const GaussDensity& g;
  std::size_t leaf, leaves;
  // What is large stays uninitialised.
  Targets(const GaussDensity& density, std::size_t first, std::size_t count)
      : g(density), leaf(first), leaves(count) {
    for (VF& v : term) v = hn::Zero(DF());
    std::memset(sum, 0, count * kGaussLeaf * sizeof *sum);
  }
  // Target r of all, in column k.
  const float* at(int k, std::size_t r) const {
    return leaf_column(g, leaf + r / kGaussLeaf, k) + r % kGaussLeaf;
  }
  Form form = Form::products;
  float centre[kAxes];
  float radius[kSpheres], width2[kSpheres];
  // Coefficients of 1, x, y, z, |x|^2 about the centre (products: of N's times T's), one sum a
  // lane.
  VF term[kTerms];
  HWY_ALIGN float sum[kMostLeaves * kGaussLeaf][kGaussLeaf];  // of pairs, one sum a lane
  std::uint32_t cut[kOpened + kGaussLeaf];                    // leaves to open
  std::size_t cuts = 0;
  List<kAxes> list;
};

HWY_INLINE unsigned bits_of(MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DF(), mask, bytes);
  std::uint32_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits & ((1u << kLanes) - 1);
}

HWY_INLINE VF norm2_of(const VF* v) {
  return hn::MulAdd(v[2], v[2], hn::MulAdd(v[1], v[1], hn::Mul(v[0], v[0])));
}
HWY_INLINE VF twice(VF v) { return hn::Add(v, v); }

// ---- pairs

template <int kAxes, Form kForm, std::size_t kCount, bool kUnit = false>
HWY_INLINE void add_pairs(Targets<kAxes>& t, std::size_t first) {
  constexpr int kSpheres = kAxes / 3;
  const DF d;
  const auto& column = t.list.column;
  VF at[kCount][kAxes], at2[kCount][kSpheres], sum[kCount];
  VF width2[kSpheres];
  for (int s = 0; s < kSpheres; ++s) width2[s] = hn::Set(d, t.width2[s]);
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    for (int k = 0; k < kAxes; ++k) {
      const float origin = kForm == Form::products ? t.centre[k] : 0.0f;
      at[r][k] = hn::Set(d, t.at(k, first)[r] - origin);
    }
    for (int s = 0; s < kSpheres; ++s) at2[r][s] = norm2_of(at[r] + 3 * s);
    for (int k = 0; k < (kUnit ? kAxes : 0); ++k) at[r][k] = twice(at[r][k]);
    sum[r] = hn::Zero(d);
  }
  for (std::size_t k = 0; k < t.list.count; k += kLanes) {
    const VF share = kUnit ? hn::Zero(d) : hn::Load(d, column[0] + k);
    VF x[kSpheres][4];
    for (int s = 0; s < kSpheres; ++s)
      for (int a = 0; a < (kForm == Form::products ? 4 : 3); ++a)
        x[s][a] = hn::Load(d, column[1 + 4 * s + a] + k);
    HWY_UNROLL(8)
    for (std::size_t r = 0; r < kCount; ++r) {
      VF hat[kSpheres];
      for (int s = 0; s < kSpheres; ++s) {
        const VF* a = at[r] + 3 * s;
        VF v;
        if constexpr (kForm == Form::products) {
          v = s == 0 && !kUnit ? hn::NegMulAdd(share, at2[r][0], x[0][3])
                               : hn::Sub(x[s][3], at2[r][s]);
          for (int i = 0; i < 3; ++i) v = hn::MulAdd(x[s][i], a[i], v);
        } else {
          v = width2[s];
          for (int i = 0; i < 3; ++i) {
            const VF gap = hn::Sub(x[s][i], a[i]);
            v = hn::NegMulAdd(gap, gap, v);
          }
        }
        hat[s] = hn::Max(v, hn::Zero(d));
      }
      if constexpr (kForm == Form::products) {
        sum[r] =
            kAxes == 3 ? hn::Add(sum[r], hat[0]) : hn::MulAdd(hat[0], hat[kSpheres - 1], sum[r]);
      } else {
        const VF both = kAxes == 3 ? hat[0] : hn::Mul(hat[0], hat[kSpheres - 1]);
        sum[r] = hn::MulAdd(share, both, sum[r]);
      }
    }
  }
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    float* const out = t.sum[first + r];
    hn::Store(hn::Add(hn::Load(d, out), sum[r]), d, out);
  }
}

template <int kAxes>
HWY_NOINLINE void work_off(Targets<kAxes>& t) {
  // Targets that share loads, as many as registers hold.
  constexpr std::size_t kCount = kLanes == 16 && kAxes == 3 ? 4 : 2;
  const DF d;
  if (t.list.count == 0) return;
  for (auto& column : t.list.column) hn::StoreU(hn::Zero(d), d, column + t.list.count);
  for (std::size_t r = 0; r < t.leaves * kGaussLeaf; r += kCount) {
    if (t.form == Form::products && kAxes == 3 && t.g.unit) {
      add_pairs<kAxes, Form::products, kCount, true>(t, r);
    } else if (t.form == Form::products) {
      add_pairs<kAxes, Form::products, kCount>(t, r);
    } else {
      add_pairs<kAxes, Form::differences, kCount>(t, r);
    }
  }
  t.list.count = 0;
}

// ---- what lies inside all supports

// Adds nodes with first coefficients about their own centroids to the polynomial: `away` from the
// targets' centre, gap = e^2 - |away|^2. Coefficients of x, y, z are left halved.
HWY_INLINE void join(VF* term, VF mass, VF a2, const VF* away, VF gap) {
  term[0] = hn::Add(term[0], hn::MulSub(mass, gap, a2));
  for (int k = 0; k < 3; ++k) term[1 + k] = hn::MulAdd(mass, away[k], term[1 + k]);
  term[4] = hn::Sub(term[4], mass);
}

// One row of the product's polynomial from its first and second moments over T.
HWY_INLINE void join_row(VF* row, VF mass, const VF* b, VF b2, const VF* away, VF gap) {
  VF constant = hn::MulSub(mass, gap, b2);
  for (int l = 0; l < 3; ++l) {
    constant = hn::NegMulAdd(twice(away[l]), b[l], constant);
    row[1 + l] = hn::Add(row[1 + l], twice(hn::MulAdd(away[l], mass, b[l])));
  }
  row[0] = hn::Add(row[0], constant);
  row[4] = hn::Sub(row[4], mass);
}

HWY_NOINLINE void join_nodes(const GaussLevel& level, std::size_t first, MF inside, const VF* away,
                             const VF* gap, VF* term) {
  const DF d;
  const auto m = [&](int k) HWY_ATTR {
    return hn::IfThenElseZero(inside, hn::Load(d, level.moment[k] + first));
  };
  const VF mass = m(kMass), a2 = m(kA2), b2 = m(kB2), zero = hn::Zero(d);
  VF ab[9], ab2[3];
  for (int k = 0; k < 9; ++k) ab[k] = m(kAB + k);
  for (int k = 0; k < 3; ++k) ab2[k] = m(kAB2 + k);
  VF b[3], square = hn::MulSub(gap[0], b2, m(kA2B2));
  for (int l = 0; l < 3; ++l) {
    b[l] = hn::Neg(m(kBA2 + l));
    for (int k = 0; k < 3; ++k) b[l] = hn::NegMulAdd(twice(away[k]), ab[3 * k + l], b[l]);
    square = hn::NegMulAdd(twice(away[l]), ab2[l], square);
  }
  join_row(term, hn::MulSub(gap[0], mass, a2), b, square, away + 3, gap[1]);
  for (int k = 0; k < 3; ++k) {
    for (int l = 0; l < 3; ++l) b[l] = twice(ab[3 * k + l]);
    join_row(term + 5 + 5 * k, twice(hn::Mul(away[k], mass)), b,
             twice(hn::MulAdd(away[k], b2, ab2[k])), away + 3, gap[1]);
  }
  for (VF& v : b) v = zero;
  join_row(term + 20, hn::Neg(mass), b, hn::Neg(b2), away + 3, gap[1]);
}

HWY_NOINLINE void join_contacts(VF share, const VF* away, const VF* gap, VF* term) {
  const VF zero = hn::Zero(DF()), none[3] = {zero, zero, zero};
  const auto row = [&](int r, VF factor)
                       HWY_ATTR { join_row(term + 5 * r, factor, none, zero, away + 3, gap[1]); };
  row(0, hn::Mul(gap[0], share));
  for (int k = 0; k < 3; ++k) row(1 + k, twice(hn::Mul(away[k], share)));
  row(4, hn::Neg(share));
}

// ---- the walk

// Opens leaves. Sums and counts stay in registers: a leaf takes less time than a store that the
// next one has to wait for.
template <int kAxes, Form kForm, bool kUnit = false>
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
  std::size_t count = t.list.count;
  for (std::size_t c = 0; c < t.cuts; ++c) {
    for (std::size_t p = 0; p < kGaussLeaf; p += kLanes) {
      const float* column = leaf_column(t.g, t.cut[c], 0) + p;
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
        hn::StoreU(hn::Compress(v, cut), d, t.list.column[k] + count);
      };
      if (!kUnit) append(0, share);
      HWY_UNROLL(2)
      for (int s = 0; s < kSpheres; ++s) {
        VF factor = hn::Set(d, 2.0f), rest = gap[s];
        if (s == 0 && !kUnit) factor = hn::Mul(factor, share), rest = hn::Mul(rest, share);
        for (int k = 0; k < 3; ++k)
          append(1 + 4 * s + k, kForm == Form::products
                                    ? kUnit ? away[3 * s + k] : hn::Mul(factor, away[3 * s + k])
                                    : hn::Load(d, column + (3 * s + k) * kGaussLeaf));
        if (kForm == Form::products) append(4 + 4 * s, rest);
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
  if (t.form == Form::products && kAxes == 3 && t.g.unit) {
    open_leaves<kAxes, Form::products, true>(t);
  } else if (t.form == Form::products) {
    open_leaves<kAxes, Form::products>(t);
  } else {
    open_leaves<kAxes, Form::differences>(t);
  }
}

// Sixteen siblings of a level; returns those to open, a bit each.
template <int kAxes>
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
    open |= bits_of(hn::AndNot(inside, near)) << p;
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

// Children of those nodes of `block`, a block of level l + 1, whose bits are set.
template <int kAxes>
void visit(Targets<kAxes>& t, int l, std::size_t block, unsigned nodes) {
  unsigned below[kGaussLeaf];
  VF term[kAxes == 3 ? 5 : 1];
  if constexpr (kAxes == 3)
    for (int k = 0; k < 5; ++k) term[k] = t.term[k];
  VF* const terms = kAxes == 3 ? term : t.term;
  std::size_t count = 0;
  for (unsigned left = nodes; left != 0; left &= left - 1) {
    const std::size_t child = block * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    below[count++] = look_at(t, t.g.level[l], child, terms);
  }
  if constexpr (kAxes == 3)
    for (int k = 0; k < 5; ++k) t.term[k] = term[k];
  count = 0;
  for (unsigned left = nodes; left != 0; left &= left - 1) {
    const std::size_t child = block * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    unsigned cut = below[count++];
    if (cut == 0) continue;
    if (l > 0) {
      visit(t, l - 1, child, cut);
      continue;
    }
    for (; cut != 0; cut &= cut - 1)
      t.cut[t.cuts++] =
          static_cast<std::uint32_t>(child * kGaussLeaf + hwy::Num0BitsBelowLS1Bit_Nonzero32(cut));
    if (t.cuts > kOpened) open(t);
  }
}

// The polynomial and the sums of pairs at the targets of lanes p and up.
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

// The middle of the box around those that weigh anything: nearer to the farthest than the centroid.
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
HWY_INLINE bool together(const GaussDensity& g, std::size_t leaf) {
  const GaussLevel& leaves = g.level[0];
  if (!(leaves.moment[kMass][leaf] > 0 && leaves.moment[kMass][leaf + 1] > 0)) return false;
  for (int s = 0; s < kAxes / 3; ++s) {
    float gap2 = 0;
    for (int k = 3 * s; k < 3 * s + 3; ++k) {
      const float gap = leaves.centre[k][leaf] - leaves.centre[k][leaf + 1];
      gap2 += gap * gap;
    }
    const float reach = kTogether * g.width[s];
    if (!(leaves.radius[s][leaf] < reach && leaves.radius[s][leaf + 1] < reach &&
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
    visit(t, g.levels - 1, 0, 1);  // the top level is one block
    open(t);
    work_off(t);
    float term[Targets<kAxes>::kTerms];
    for (int k = 0; k < Targets<kAxes>::kTerms; ++k)
      term[k] = hn::GetLane(hn::SumOfLanes(d, t.term[k]));
    if constexpr (kAxes == 3)
      for (int k = 1; k < 4; ++k) term[k] *= 2;  // join has left them halved
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
    const std::size_t leaves = leaf + 1 < end && together<kAxes>(g, leaf) ? 2 : 1;
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
    // A contact's own share is in its density, whatever rounding takes from a light one.
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
