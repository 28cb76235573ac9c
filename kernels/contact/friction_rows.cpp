// SPDX-License-Identifier: Apache-2.0
// friction_rows.cpp - the SIMD twin of friction_rows_ref.cpp.
//
// Lines and loads are computed in float, everything else in double. A vector of rows without load
// is left out, which changes no bit.
#include "kernels/contact/friction_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/friction_rows.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"
#include "kernels/totals-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DD = hn::ScalableTag<double>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;
using VF = hn::Vec<DF>;

template <class V>
HWY_INLINE V dot(const V a[3], const V b[3]) {
  return hn::MulAdd(a[0], b[0], hn::MulAdd(a[1], b[1], hn::Mul(a[2], b[2])));
}
template <class V>
HWY_INLINE V cross(V a, V b, V c, V e) {
  return hn::NegMulAdd(c, e, hn::Mul(a, b));  // ab - ce
}

void lines_simd(const ContactColumns& c, const float* pressed, const PushLines& out,
                PushLineRows& rows) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f), no_lean = hn::Set(d, kNoLean * kNoLean);
  VD total = hn::Zero(DD());
  std::size_t to = 0;
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    const VF n[3] = {load_n(d, c.nx + i, live), load_n(d, c.ny + i, live),
                     load_n(d, c.nz + i, live)};
    const VF g[3] = {load_n(d, c.gx + i, live), load_n(d, c.gy + i, live),
                     load_n(d, c.gz + i, live)};
    const VF press = load_n(d, pressed + i, live);
    const VF across[3] = {cross(n[1], g[2], n[2], g[1]), cross(n[2], g[0], n[0], g[2]),
                          cross(n[0], g[1], n[1], g[0])};
    const VF squared = dot(across, across), cosine = dot(n, g);
    // Contacts on flat walls lean too little; they need no root and no quotient.
    const VF least = hn::Mul(no_lean, hn::Mul(cosine, hn::Max(cosine, zero)));
    const auto rubs = hn::And(hn::Gt(squared, least), hn::Gt(press, zero));
    if (hn::AllFalse(d, rubs)) continue;
    const VF sine = hn::Sqrt(squared);
    const VF most = hn::Max(hn::Mul(sine, hn::Set(d, 1 / kMostRub)), cosine);
    const VF t = hn::Div(sine, most);
    const VF share = hn::Max(hn::MulSub(t, hn::Set(d, 1 / kNoLean), one), zero);
    const VF load = hn::IfThenElseZero(rubs, hn::Mul(hn::Mul(t, hn::Min(share, one)), press));
    const auto counts = hn::Gt(load, zero);
    const VF per_sine = hn::IfThenElseZero(counts, hn::Div(one, sine));
    float* const e[3] = {out.ex, out.ey, out.ez};
    for (int k = 0; k < 3; ++k)
      store_n(hn::IfThenElseZero(counts, hn::Mul(hn::MulSub(n[k], cosine, g[k]), per_sine)), d,
              e[k] + to, live);
    store_n(load_n(d, c.rx + i, live), d, out.rx + to, live);
    store_n(load_n(d, c.ry + i, live), d, out.ry + to, live);
    store_n(load_n(d, c.rz + i, live), d, out.rz + to, live);
    store_n(load, d, out.load + to, live);
    total = hn::Add(total, hn::PromoteTo(DD(), load));
    to += HWY_MIN(live, hn::Lanes(d));
  }
  rows = {to, hn::GetLane(hn::SumOfLanes(DD(), total))};
}

struct Row {
  VD n[3], r[3];
};
HWY_INLINE VD load_column(const float* from, std::size_t live) {
  return hn::PromoteTo(DD(), load_n(DF(), from, live));
}
HWY_INLINE Row row_at(const FrictionRows& c, std::size_t i, std::size_t live) {
  const DD d;
  Row row{{load_column(c.nx + i, live), load_column(c.ny + i, live), load_column(c.nz + i, live)},
          {load_column(c.rx + i, live), load_column(c.ry + i, live), load_column(c.rz + i, live)}};
  // A step of Newton's method makes the unit vector of floats one of doubles.
  const VD scale = hn::NegMulAdd(hn::Set(d, 0.5), dot(row.n, row.n), hn::Set(d, 1.5));
  for (VD& n : row.n) n = hn::Mul(n, scale);
  return row;
}

// A displacement in all lanes.
struct Displacement {
  VD q[6];
};
HWY_INLINE Displacement in_all_lanes(const double q[6]) {
  const DD d;
  return {{hn::Set(d, q[0]), hn::Set(d, q[1]), hn::Set(d, q[2]), hn::Set(d, q[3]), hn::Set(d, q[4]),
           hn::Set(d, q[5])}};
}

// n.(d + theta x r), and with it |z| or its square.
struct Stretch {
  VD along, length;
};
template <bool kLines, bool kSquared>
HWY_INLINE Stretch stretch_of(const Row& row, const Displacement& by) {
  const VD *q = by.q, *r = row.r;
  VD z[3] = {hn::Add(q[0], cross(q[4], r[2], q[5], r[1])),
             hn::Add(q[1], cross(q[5], r[0], q[3], r[2])),
             hn::Add(q[2], cross(q[3], r[1], q[4], r[0]))};
  const VD along = dot(row.n, z);
  if constexpr (kLines) {
    return {along, hn::Max(along, hn::Zero(DD()))};
  } else {
    for (int k = 0; k < 3; ++k) z[k] = hn::NegMulAdd(along, row.n[k], z[k]);
    const VD squared = dot(z, z);
    return {along, kSquared ? squared : hn::Sqrt(squared)};
  }
}

HWY_INLINE bool no_load(VF load) { return hn::AllFalse(DF(), hn::Gt(load, hn::Zero(DF()))); }

template <bool kLines>
HWY_INLINE void stretch_rows(const FrictionRows& rows, const double* q, double* stretch) {
  const DD d;
  const Displacement by = in_all_lanes(q);
  for (std::size_t i = 0; i < rows.count; i += hn::Lanes(d)) {
    const std::size_t live = rows.count - i;
    const bool idle = no_load(load_n(DF(), rows.load + i, live));
    const VD z = idle ? hn::Zero(d) : stretch_of<kLines, false>(row_at(rows, i, live), by).length;
    store_n(z, d, stretch + i, live);
  }
}
void stretch_simd(const FrictionRows& rows, const double* q, double* stretch) {
  rows.lines ? stretch_rows<true>(rows, q, stretch) : stretch_rows<false>(rows, q, stretch);
}

void sums_simd(const float* load, const double* stretch, std::size_t count, double share,
               double limit, FrictionSums& out) {
  const DD d;
  const VD zero = hn::Zero(d), most = hn::Set(d, limit), part = hn::Set(d, share);
  VD sums[6] = {zero, zero, zero, zero, zero, zero};
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF some = load_n(DF(), load + i, count - i);
    if (no_load(some)) continue;
    const VD l = hn::PromoteTo(d, some);
    const VD z =
        hn::IfThenElseZero(hn::Gt(l, zero), hn::Mul(part, load_n(d, stretch + i, count - i)));
    const VD c = hn::Min(z, most), lz = hn::Mul(l, z), lc = hn::Mul(l, c);
    sums[0] = hn::Add(sums[0], hn::IfThenElseZero(hn::Gt(z, zero), l));
    sums[1] = hn::Add(sums[1], lz);
    sums[2] = hn::Add(sums[2], lc);
    sums[3] = hn::Add(sums[3], hn::IfThenElseZero(hn::Lt(z, most), lz));
    sums[4] = hn::MulAdd(lc, hn::NegMulAdd(hn::Set(d, 0.5), c, z), sums[4]);
    sums[5] = hn::Max(sums[5], z);
  }
  double totals[6];
  for (int k = 0; k < 4; k += 2) total_two(sums[k], sums[k + 1], totals + k);
  total_two(sums[4], hn::IfThenElseZero(hn::Gt(sums[5], most), sums[5]), totals + 4);
  out = {totals[0], totals[1], totals[2], totals[3], totals[4], totals[5] > 0};
}

// Sums over rows: the upper triangle of sum s J J^T, J = [n; r x n], and for planes s, s r and the
// upper triangle of s r r^T.
constexpr int kTriangle = 21, kArms = kTriangle + 1, kSquares = kArms + 3, kSums = kSquares + 6 + 1;

template <bool kLines>
HWY_INLINE void sum_stiffness(const FrictionRows& rows, const FrictionSecant& secant,
                              const double* q, const double* ahead, double* totals) {
  const DD d;
  const VD zero = hn::Zero(d), limit = hn::Set(d, secant.limit);
  const Displacement now = in_all_lanes(q), then = in_all_lanes(ahead);
  VD sums[kSums];
  HWY_UNROLL(32)
  for (int k = 0; k < kSums; ++k) sums[k] = zero;
  for (std::size_t i = 0; i < rows.count; i += hn::Lanes(d)) {
    const std::size_t live = rows.count - i;
    const VF some = load_n(DF(), rows.load + i, live);
    if (no_load(some)) continue;
    const Row row = row_at(rows, i, live);
    const Stretch a = stretch_of<kLines, true>(row, now);
    VD z = hn::Max(a.length, stretch_of<kLines, true>(row, then).length);
    if constexpr (!kLines) z = hn::Sqrt(z);
    VD s = hn::Div(hn::Mul(hn::Set(d, secant.scale), hn::PromoteTo(d, some)), hn::Max(limit, z));
    if constexpr (kLines) s = hn::IfThenElseZero(hn::Ge(a.along, zero), s);
    const VD *n = row.n, *r = row.r;
    const VD J[6] = {n[0],
                     n[1],
                     n[2],
                     cross(r[1], n[2], r[2], n[1]),
                     cross(r[2], n[0], r[0], n[2]),
                     cross(r[0], n[1], r[1], n[0])};
    int at = 0;
    HWY_UNROLL(6)
    for (int k = 0; k < 6; ++k) {
      const VD sJ = hn::Mul(s, J[k]);
      HWY_UNROLL(6)
      for (int l = k; l < 6; ++l, ++at) sums[at] = hn::MulAdd(sJ, J[l], sums[at]);
    }
    if constexpr (kLines) continue;
    sums[kTriangle] = hn::Add(sums[kTriangle], s);
    at = kSquares;
    HWY_UNROLL(3)
    for (int k = 0; k < 3; ++k) {
      const VD sr = hn::Mul(s, r[k]);
      sums[kArms + k] = hn::Add(sums[kArms + k], sr);
      HWY_UNROLL(3)
      for (int l = k; l < 3; ++l, ++at) sums[at] = hn::MulAdd(sr, r[l], sums[at]);
    }
  }
  constexpr int kCount = kLines ? kTriangle + 1 : kSums;
  HWY_UNROLL(16)
  for (int k = 0; k < kCount; k += 2) total_two(sums[k], sums[k + 1], totals + k);
}

// Adds `sign` times the symmetric matrix whose upper triangle is given.
HWY_INLINE void add_triangle(const double* triangle, double sign, double* K) {
  for (int k = 0, at = 0; k < 6; ++k)
    for (int l = k; l < 6; ++l, ++at) {
      K[6 * k + l] += sign * triangle[at];
      if (l > k) K[6 * l + k] += sign * triangle[at];
    }
}

// Adds sum s [I, -[r]x; [r]x, |r|^2 I - r r^T]: a spring in all directions.
HWY_INLINE void add_sphere(const double* totals, double* K) {
  const double *arm = totals + kArms, *rr = totals + kSquares;
  const double square[3][3] = {{rr[0], rr[1], rr[2]}, {rr[1], rr[3], rr[4]}, {rr[2], rr[4], rr[5]}};
  const double trace = rr[0] + rr[3] + rr[5];
  const double turn[3][3] = {{0, arm[2], -arm[1]}, {-arm[2], 0, arm[0]}, {arm[1], -arm[0], 0}};
  for (int k = 0; k < 3; ++k) {
    K[7 * k] += totals[kTriangle];
    K[7 * (3 + k)] += trace;
    for (int l = 0; l < 3; ++l) {
      K[6 * k + 3 + l] += turn[k][l];
      K[6 * (3 + l) + k] += turn[k][l];
      K[6 * (3 + k) + 3 + l] -= square[k][l];
    }
  }
}

void stiffness_simd(const FrictionRows& rows, const FrictionSecant& secant, const double* q,
                    const double* ahead, double* K) {
  double totals[kSums];
  if (rows.lines) {
    sum_stiffness<true>(rows, secant, q, ahead, totals);
    return add_triangle(totals, 1, K);
  }
  sum_stiffness<false>(rows, secant, q, ahead, totals);
  add_triangle(totals, -1, K);
  add_sphere(totals, K);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(lines_simd);
HWY_EXPORT(stretch_simd);
HWY_EXPORT(sums_simd);
HWY_EXPORT(stiffness_simd);

PushLineRows push_lines(const ContactColumns& c, const float* pressed, const PushLines& out) {
  PushLineRows rows;
  HWY_DYNAMIC_DISPATCH(lines_simd)(c, pressed, out, rows);
  return rows;
}
void friction_stretch(const FrictionRows& rows, const double q[6], double* stretch) {
  HWY_DYNAMIC_DISPATCH(stretch_simd)(rows, q, stretch);
}
FrictionSums friction_sums(const float* load, const double* stretch, std::size_t count,
                           double share, double limit) {
  FrictionSums sums;
  HWY_DYNAMIC_DISPATCH(sums_simd)(load, stretch, count, share, limit, sums);
  return sums;
}
void friction_stiffness(const FrictionRows& rows, const FrictionSecant& secant, const double q[6],
                        const double ahead[6], double K[36]) {
  HWY_DYNAMIC_DISPATCH(stiffness_simd)(rows, secant, q, ahead, K);
}

}  // namespace h6::kernels
#endif
