// SPDX-License-Identifier: Apache-2.0
// contact_wrench.cpp - the SIMD twin of contact_wrench_ref.cpp.
//
// Lanes are doubles: sums of many contacts nearly cancel, and products of floats are exact in
// double. The result agrees with the reference to 1e-13 of the sum of magnitudes. Contacts are
// copied to a small stage of columns, and each row of the result is summed over the stage:
//
//     columns (float) -> stage: J, J_g, kw J, kw e, kw depth (double, 128 contacts)
//                     -> lanes of 33 or 69 sums -> one reduction at the end
#include "kernels/contact/contact_wrench.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/contact_wrench.cpp"
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

constexpr std::size_t kStage = 128;  // contacts; a multiple of every vector length
constexpr std::size_t kWidth = hn::MaxLanes(DD());

struct Stage {
  HWY_ALIGN double J[6][kStage];
  HWY_ALIGN double Jg[6][kStage];
  HWY_ALIGN double kwJ[6][kStage];
  HWY_ALIGN double kwe[kStage];
  HWY_ALIGN double kwd[kStage];
};

// Lanes of every sum: force, elastic, B, K. B is symmetric: row `row` has the columns from `row`
// on.
constexpr int kElastic = 6, kB = 12, kK = 33, kSums = 69;
constexpr int row_of_b(int row) { return kB + 6 * row - row * (row - 1) / 2 - row; }  // column 0

struct Sums {
  HWY_ALIGN double lanes[kSums + 1][kWidth];
};

HWY_INLINE VD load_column(const float* column, std::size_t first, std::size_t live) {
  return hn::PromoteTo(DD(), load_n(DF(), column + first, live));
}

HWY_INLINE VD cross(VD a, VD b, VD c, VD e) {
  return hn::NegMulAdd(c, e, hn::Mul(a, b));
}  // ab - ce

struct Axis6 {
  VD v[6];
};

// [v; r x v]
HWY_INLINE Axis6 wrench_axis(VD x, VD y, VD z, VD rx, VD ry, VD rz) {
  return {{x, y, z, cross(ry, z, rz, y), cross(rz, x, rx, z), cross(rx, y, ry, x)}};
}

// Copies contacts from `first` on to the stage until it is full or no contact is left, and returns
// where it stopped. A vector of contacts without load is left out, which changes no bit. Lanes past
// the end are zero. `staged`: the number of lanes on the stage.
HWY_INLINE std::size_t fill(const WrenchColumns& c, const WrenchParameters& p, std::size_t first,
                            std::size_t end, Stage& stage, std::size_t& staged) {
  const DD d;
  staged = 0;
  std::size_t at = first;
  for (; at < end && staged < kStage; at += hn::Lanes(d)) {
    const std::size_t live = end - at;
    const VD full = load_column(c.weight, at, live), depth = load_column(c.depth, at, live);
    auto carries = hn::Ne(full, hn::Zero(d));
    if (p.damping == 0) carries = hn::And(carries, hn::Gt(depth, hn::Zero(d)));
    if (hn::AllFalse(d, carries)) continue;
    const VD rx = load_column(c.rx, at, live), ry = load_column(c.ry, at, live);
    const VD rz = load_column(c.rz, at, live);
    const Axis6 J = wrench_axis(load_column(c.nx, at, live), load_column(c.ny, at, live),
                                load_column(c.nz, at, live), rx, ry, rz);
    VD approach = hn::Zero(d);  // J.u
    for (int k = 0; k < 6; ++k) approach = hn::MulAdd(J.v[k], hn::Set(d, p.velocity[k]), approach);
    const VD e = hn::NegMulAdd(hn::Set(d, p.damping), approach, depth);
    const VD weight = hn::IfThenElseZero(hn::Gt(e, hn::Zero(d)), full);
    const VD kw = hn::Mul(hn::Set(d, p.stiffness), weight);
    hn::Store(hn::Mul(kw, e), d, stage.kwe + staged);
    hn::Store(hn::Mul(kw, depth), d, stage.kwd + staged);
    for (int k = 0; k < 6; ++k) {
      hn::Store(J.v[k], d, stage.J[k] + staged);
      hn::Store(hn::Mul(kw, J.v[k]), d, stage.kwJ[k] + staged);
    }
    if (p.exact) {
      const Axis6 Jg = wrench_axis(load_column(c.gx, at, live), load_column(c.gy, at, live),
                                   load_column(c.gz, at, live), rx, ry, rz);
      for (int k = 0; k < 6; ++k) hn::Store(Jg.v[k], d, stage.Jg[k] + staged);
    }
    staged += hn::Lanes(d);
  }
  return at;
}

// sum[col] += factor * columns[col] over the stage, for col from kFrom on; `fresh`: sums start at
// 0.
template <int kFrom>
HWY_INLINE void add_row(const double* factor, const double (*columns)[kStage], std::size_t count,
                        bool fresh, double (*sum)[kWidth]) {
  const DD d;
  VD lanes[6];
  HWY_UNROLL(8)
  for (int col = kFrom; col < 6; ++col) lanes[col] = hn::Zero(d);
  if (!fresh) {
    HWY_UNROLL(8)
    for (int col = kFrom; col < 6; ++col) lanes[col] = hn::Load(d, sum[col]);
  }
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VD f = hn::Load(d, factor + i);
    HWY_UNROLL(8)
    for (int col = kFrom; col < 6; ++col) {
      lanes[col] = hn::MulAdd(f, hn::Load(d, columns[col] + i), lanes[col]);
    }
  }
  HWY_UNROLL(8)
  for (int col = kFrom; col < 6; ++col) hn::Store(lanes[col], d, sum[col]);
}

HWY_INLINE void total(const Sums& sums, int count, double* to) {
  const DD d;
  for (int k = 0; k < count; k += 2)
    total_two(hn::Load(d, sums.lanes[k]), hn::Load(d, sums.lanes[k + 1]), to + k);
}

void contact_wrench_simd(const WrenchColumns& contacts, const WrenchParameters& parameters,
                         std::size_t begin, std::size_t end, WrenchSum& out) {
  Stage stage;
  Sums sums;
  const int count = parameters.exact ? kSums : kK;
  hn::Store(hn::Zero(DD()), DD(), sums.lanes[count]);  // beside the last one
  std::size_t first = begin;
  do {
    const bool fresh = first == begin;
    std::size_t staged;
    first = fill(contacts, parameters, first, end, stage, staged);
    add_row<0>(stage.kwe, stage.J, staged, fresh, sums.lanes);
    add_row<0>(stage.kwd, stage.J, staged, fresh, sums.lanes + kElastic);
    add_row<0>(stage.kwJ[0], stage.J, staged, fresh, sums.lanes + row_of_b(0));
    add_row<1>(stage.kwJ[1], stage.J, staged, fresh, sums.lanes + row_of_b(1));
    add_row<2>(stage.kwJ[2], stage.J, staged, fresh, sums.lanes + row_of_b(2));
    add_row<3>(stage.kwJ[3], stage.J, staged, fresh, sums.lanes + row_of_b(3));
    add_row<4>(stage.kwJ[4], stage.J, staged, fresh, sums.lanes + row_of_b(4));
    add_row<5>(stage.kwJ[5], stage.J, staged, fresh, sums.lanes + row_of_b(5));
    if (!parameters.exact) continue;
    for (int row = 0; row < 6; ++row)
      add_row<0>(stage.kwJ[row], stage.Jg, staged, fresh, sums.lanes + kK + 6 * row);
  } while (first < end);
  double totals[kSums + 1];
  total(sums, count + 1, totals);
  for (int row = 0; row < 6; ++row) {
    out.force[row] = totals[row];
    out.elastic[row] = totals[kElastic + row];
    for (int col = 0; col < 6; ++col) {
      const double damping = totals[col < row ? row_of_b(col) + row : row_of_b(row) + col];
      out.damping[6 * row + col] = damping;
      out.stiffness[6 * row + col] = parameters.exact ? totals[kK + 6 * row + col] : damping;
    }
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(contact_wrench_simd);

void contact_wrench(const WrenchColumns& contacts, const WrenchParameters& parameters,
                    std::size_t begin, std::size_t end, WrenchSum& sum) {
  HWY_DYNAMIC_DISPATCH(contact_wrench_simd)(contacts, parameters, begin, end, sum);
}

}  // namespace h6::kernels
#endif
