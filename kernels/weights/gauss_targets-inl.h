// SPDX-License-Identifier: Apache-2.0
// gauss_targets-inl.h - the targets of gauss_tree_sum.cpp: their list of contacts that are summed
// pair by pair, and the polynomial of the nodes that lie inside all supports.
//
// Included once for each SIMD target.
#include <cmath>
#include <cstring>

#include "kernels/weights/gauss_tree_stages.h"

// Per-target include guard.
#if defined(H6_KERNELS_GAUSS_TARGETS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_GAUSS_TARGETS_INL_H_
#undef H6_KERNELS_GAUSS_TARGETS_INL_H_
#else
#define H6_KERNELS_GAUSS_TARGETS_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, kGaussLeaf>;
using VF = hn::Vec<DF>;
using MF = hn::Mask<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kListed = 512;  // contacts and nodes on the list before it is summed
// With two leaves of 0.1 a clump of 100,000 took 1.34 times as long by AVX2, 1.39 by AVX-512
// (kernels/gauss_tree/gauss6/clump).
constexpr std::size_t kMostLeaves = 8;  // leaves of targets in one walk
constexpr float kTogether = 0.3f;       // widths: size and distance of leaves that share a walk
constexpr std::size_t kOpened = 256;    // leaves collected before they are opened
constexpr float kSmallNode = 0.1f;      // widths: the radius below which a node is listed whole

// How a pair is evaluated. products: c + 2 t.x, with x and t relative to the targets' centre;
// precise enough while targets are within a width of the centre. flat: the same over one sphere of
// unit vectors, where all contacts' shares are 1; see lay_flat. differences: in all other cases.
enum class Form { flat, products, differences };

// Columns of listed contacts, 4 a sphere behind the share. Form products: the share, then 2 x and
// e^2 - |x|^2 over each sphere, the first sphere times the share. Form flat: the share, then x
// along both tangents and e^2 - |x|^2. Form differences: the share, then x.
template <int kAxes>
struct List {
  HWY_ALIGN float column[1 + 4 * kAxes / 3][kListed + 2 * kGaussLeaf];
  std::size_t count = 0;
};

// The contacts of one leaf, or of some consecutive ones, whose densities are computed together.
template <int kAxes>
struct Targets {
  static constexpr int kSpheres = kAxes / 3;
  static constexpr int kTerms = kAxes == 3 ? 5 : 25;
  const GaussDensity& g;
  std::size_t leaf, leaves;
  // Large members stay uninitialised.
  Targets(const GaussDensity& density, std::size_t first, std::size_t count)
      : g(density), leaf(first), leaves(count) {
    for (VF& v : term) v = hn::Zero(DF());
    std::memset(sum, 0, count * kGaussLeaf * sizeof *sum);
  }
  // Column k of target r.
  const float* at(int k, std::size_t r) const {
    return leaf_column(g, leaf + r / kGaussLeaf, k) + r % kGaussLeaf;
  }
  Form form = Form::products;
  float centre[kAxes];
  float radius[kSpheres], width2[kSpheres];
  // Form flat: two tangents at the centre, and of each target its place along both, the value from
  // which a pair counts, and the scale of its sum.
  float tangent[2][3];
  HWY_ALIGN float flat[4][kMostLeaves * kGaussLeaf];
  // Coefficients of 1, x, y, z, |x|^2 about the centre (products: of N's times T's), one sum a
  // lane.
  VF term[kTerms];
  HWY_ALIGN float sum[kMostLeaves * kGaussLeaf][kGaussLeaf];  // over pairs, one sum a lane
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

template <int kAxes, Form kForm, std::size_t kCount>
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
    sum[r] = hn::Zero(d);
  }
  for (std::size_t k = 0; k < t.list.count; k += kLanes) {
    const VF share = hn::Load(d, column[0] + k);
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
          v = s == 0 ? hn::NegMulAdd(share, at2[r][0], x[0][3]) : hn::Sub(x[s][3], at2[r][s]);
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

// Two tangents of the unit sphere at c.
HWY_INLINE void take_tangents(const float* c, float height2, float (*tangent)[3]) {
  float *const p = tangent[0], *const q = tangent[1];
  const int far = std::fabs(c[0]) < std::fabs(c[1]) ? 0 : 1;  // an axis far from c
  for (int k = 0; k < 3; ++k) p[k] = (k == far ? 1.0f : 0.0f) - c[far] / height2 * c[k];
  const float per_p = 1 / std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  const float per_c = 1 / std::sqrt(height2);
  for (int k = 0; k < 3; ++k) p[k] *= per_p;
  for (int k = 0; k < 3; ++k)
    q[k] = (c[(k + 1) % 3] * p[(k + 2) % 3] - c[(k + 2) % 3] * p[(k + 1) % 3]) * per_c;
}

// The part of x along an axis.
HWY_INLINE VF along(const VF* x, const float* axis) {
  const DF d;
  return hn::MulAdd(x[2], hn::Set(d, axis[2]),
                    hn::MulAdd(x[1], hn::Set(d, axis[1]), hn::Mul(x[0], hn::Set(d, axis[0]))));
}

// Lays targets flat. Contacts are unit vectors, so the height of one over the tangent plane at the
// targets' centre C follows from its distance x:
//     2 C.x = 1 - |C|^2 - |x|^2
// With c = e^2 - |x|^2, e^2 - |x - t|^2 is then b (c + 2 t'.x - l) where t' and x have two axes,
// and b = 1 + C.t / |C|^2. Returns whether all lengths are so near to 1 that this is precise.
HWY_INLINE bool lay_flat(Targets<3>& t) {
  const DF d;
  const float* const c = t.centre;
  const float height2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
  if (!(height2 > 0.5f)) return false;
  take_tangents(c, height2, t.tangent);
  const VF one = hn::Set(d, 1.0f), rest = hn::Set(d, t.width2[0] - (1 - height2));
  VF most = hn::Zero(d);
  for (std::size_t p = 0; p < t.leaves * kGaussLeaf; p += kLanes) {
    VF at[3];
    for (int k = 0; k < 3; ++k) at[k] = hn::Sub(hn::Load(d, t.at(k, p)), hn::Set(d, c[k]));
    const VF up = hn::Mul(along(at, c), hn::Set(d, 1 / height2)), scale = hn::Add(one, up);
    const VF twice_per_scale = hn::Div(hn::Set(d, 2.0f), scale);
    for (int k = 0; k < 2; ++k)
      hn::Store(hn::Mul(along(at, t.tangent[k]), twice_per_scale), d, t.flat[k] + p);
    hn::Store(hn::Div(hn::MulAdd(up, rest, norm2_of(at)), scale), d, t.flat[2] + p);
    hn::Store(scale, d, t.flat[3] + p);
    most = hn::Max(most, hn::Abs(up));
  }
  // An error of |x|^2 counts |C.t| / |C|^2 times.
  const float worst = hn::GetLane(hn::MaxOfLanes(d, most));
  return worst < 0.5f && worst * *t.g.uneven <= 0x1p-21f * t.width2[0];
}

template <std::size_t kCount>
HWY_INLINE void add_flat_pairs(Targets<3>& t, std::size_t first) {
  const DF d;
  const auto& column = t.list.column;
  VF at[kCount][2], least[kCount], sum[kCount];
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    for (int k = 0; k < 2; ++k) at[r][k] = hn::Set(d, t.flat[k][first + r]);
    least[r] = hn::Set(d, t.flat[2][first + r]);
    sum[r] = hn::Zero(d);
  }
  for (std::size_t k = 0; k < t.list.count; k += kLanes) {
    const VF share = hn::Load(d, column[0] + k), c = hn::Load(d, column[3] + k);
    const VF x = hn::Load(d, column[1] + k), y = hn::Load(d, column[2] + k);
    HWY_UNROLL(8)
    for (std::size_t r = 0; r < kCount; ++r) {
      VF v = hn::MulAdd(x, at[r][0], hn::NegMulAdd(share, least[r], c));
      v = hn::MulAdd(y, at[r][1], v);
      sum[r] = hn::Add(sum[r], hn::Max(v, hn::Zero(d)));
    }
  }
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    float* const out = t.sum[first + r];
    const VF scale = hn::Set(d, t.flat[3][first + r]);
    hn::Store(hn::MulAdd(sum[r], scale, hn::Load(d, out)), d, out);
  }
}

template <int kAxes>
HWY_NOINLINE void work_off(Targets<kAxes>& t) {
  // The number of targets that share loads: as many as the registers hold.
  constexpr std::size_t kCount = kLanes == 16 && kAxes == 3 ? 4 : 2;
  const DF d;
  const std::size_t rows = t.leaves * kGaussLeaf, count = t.list.count;
  if (count == 0) return;
  for (auto& column : t.list.column) hn::StoreU(hn::Zero(d), d, column + count);
  if (t.form == Form::flat) {
    if constexpr (kAxes == 3) {
      for (std::size_t r = 0; r < rows; r += 4) add_flat_pairs<4>(t, r);
    }
  } else if (t.form == Form::products) {
    for (std::size_t r = 0; r < rows; r += kCount) add_pairs<kAxes, Form::products, kCount>(t, r);
  } else {
    for (std::size_t r = 0; r < rows; r += kCount)
      add_pairs<kAxes, Form::differences, kCount>(t, r);
  }
  t.list.count = 0;
}

// ---- nodes inside all supports

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

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
