// SPDX-License-Identifier: Apache-2.0
// contact_columns.cpp - the SIMD twin of contact_columns_ref.cpp.
//
// Directions and shares are computed in float, gaps in double, since depths may differ by little.
// Directions agree with the reference to a few 2^-24 times |r| over the length of the divisor.
#include "kernels/contact/contact_columns.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/contact_columns.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::ScalableTag<float>;
using DD = hn::ScalableTag<double>;

// D: the tag of the lanes; columns are floats.
template <class D>
HWY_INLINE hn::Vec<D> column_at(D, const float* column, std::size_t i, std::size_t live) {
  if constexpr (sizeof(hn::TFromD<D>) == sizeof(float)) {
    return load_n(D(), column + i, live);
  } else {
    return hn::PromoteTo(D(), load_n(hn::Rebind<float, D>(), column + i, live));
  }
}

// N and r x N.
template <class D>
struct Axis {
  hn::Vec<D> v[6];
};
template <class D>
HWY_INLINE Axis<D> axis_at(D d, const ContactColumns& c, std::size_t i) {
  const std::size_t live = c.count - i;
  const auto nx = column_at(d, c.nx, i, live), ny = column_at(d, c.ny, i, live);
  const auto nz = column_at(d, c.nz, i, live), rx = column_at(d, c.rx, i, live);
  const auto ry = column_at(d, c.ry, i, live), rz = column_at(d, c.rz, i, live);
  return {{nx, ny, nz, hn::NegMulAdd(rz, ny, hn::Mul(ry, nz)),
           hn::NegMulAdd(rx, nz, hn::Mul(rz, nx)), hn::NegMulAdd(ry, nx, hn::Mul(rx, ny))}};
}

void facing_simd(const ContactColumns& c, float edge, float* facing) {
  const DF d;
  const auto per_edge = hn::Set(d, 1 / edge), one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    auto dot = hn::Mul(load_n(d, c.nx + i, live), load_n(d, c.gx + i, live));
    dot = hn::MulAdd(load_n(d, c.ny + i, live), load_n(d, c.gy + i, live), dot);
    dot = hn::MulAdd(load_n(d, c.nz + i, live), load_n(d, c.gz + i, live), dot);
    const auto share = hn::Min(hn::Max(hn::Mul(dot, per_edge), hn::Zero(d)), one);
    store_n(share, d, facing + i, live);
  }
}

// G and the share of kMostLean towards it, of contacts with distances around them.
struct Slope {
  hn::Vec<DF> g[3], lean;
};
HWY_INLINE Slope slope_at(const ContactColumns& c, const Crosses* crosses, std::size_t i,
                          std::size_t live) {
  const DF d;
  Slope s{{load_n(d, c.gx + i, live), load_n(d, c.gy + i, live), load_n(d, c.gz + i, live)},
          hn::Set(d, 1.0f)};
  if (!crosses) return s;
  const Crosses& a = *crosses;
  hn::Vec<DF> at[7];
  for (int k = 0; k < 7; ++k) at[k] = load_n(d, a.at[k] + i, live);
  const auto x = hn::Sub(at[1], at[2]), y = hn::Sub(at[3], at[4]), z = hn::Sub(at[5], at[6]);
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  auto sure = hn::Sub(hn::Set(d, 2 * (a.band - a.step)), hn::Mul(hn::Set(d, 2.0f), hn::Abs(at[0])));
  sure = hn::Min(hn::Max(sure, zero), one);
  const auto per_step = hn::Set(d, 1 / (2 * a.step));
  for (int k = 0; k < 3; ++k) {
    auto turned = hn::Mul(hn::Set(d, a.turn[3 * k]), x);
    turned = hn::MulAdd(hn::Set(d, a.turn[3 * k + 1]), y, turned);
    turned = hn::MulAdd(hn::Set(d, a.turn[3 * k + 2]), z, turned);
    s.g[k] = hn::MulAdd(sure, hn::Sub(hn::Mul(turned, per_step), s.g[k]), s.g[k]);
  }
  const auto ends =
      hn::Add(hn::Add(hn::Add(at[1], at[2]), hn::Add(at[3], at[4])), hn::Add(at[5], at[6]));
  const auto bend = hn::NegMulAdd(hn::Set(d, 6.0f), at[0], ends);
  const float span = kLeanFull - kLeanFrom;
  auto shallow =
      hn::MulAdd(hn::Set(d, 1 / (2 * a.step * span)), at[0], hn::Set(d, kLeanFull / span));
  shallow = hn::Min(hn::Max(shallow, zero), one);
  const auto sharp = hn::Mul(sure, hn::Mul(bend, hn::Set(d, 1 / (a.step * a.step * kSharp))));
  const auto bent = hn::Div(s.lean, hn::MulAdd(sharp, sharp, one));
  s.lean = hn::MulAdd(shallow, hn::Sub(bent, s.lean), s.lean);
  return s;
}

void directions_simd(const ContactColumns& c, const Crosses* crosses, float* nx, float* ny,
                     float* nz, float* facing) {
  const DF d;
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    const hn::Vec<DF> N[3] = {load_n(d, c.nx + i, live), load_n(d, c.ny + i, live),
                              load_n(d, c.nz + i, live)};
    const Slope s = slope_at(c, crosses, i, live);
    auto dot = hn::Mul(N[0], s.g[0]);
    dot = hn::MulAdd(N[1], s.g[1], dot);
    dot = hn::MulAdd(N[2], s.g[2], dot);
    auto share = one, lean = hn::Mul(hn::Set(d, kMostLean), s.lean);
    if (!hn::AllFalse(d, hn::Lt(dot, zero))) {  // else there is nothing to divide
      const auto still = hn::MulAdd(hn::Set(d, kStillFacingLeaning - kStillFacing), s.lean,
                                    hn::Set(d, kStillFacing));
      share = hn::Min(hn::Max(hn::Sub(one, hn::Div(dot, still)), zero), one);
      // Down to N.G = -most / kMostLean the lean is below its limit anyway.
      constexpr float most = 1 - kLeastAlong;
      const auto limit =
          hn::Div(hn::Set(d, most), hn::Max(hn::Neg(dot), hn::Set(d, most / kMostLean)));
      lean = hn::IfThenElseZero(hn::Gt(share, zero), hn::Min(lean, limit));
    }
    hn::Vec<DF> to[3];
    auto length2 = zero;
    for (int k = 0; k < 3; ++k) {
      to[k] = hn::MulAdd(lean, s.g[k], N[k]);
      length2 = hn::MulAdd(to[k], to[k], length2);
    }
    const auto scale = hn::Div(one, hn::Sqrt(length2));
    store_n(hn::Mul(to[0], scale), d, nx + i, live);
    store_n(hn::Mul(to[1], scale), d, ny + i, live);
    store_n(hn::Mul(to[2], scale), d, nz + i, live);
    store_n(share, d, facing + i, live);
  }
}

void firmness_simd(const float* depth, std::size_t count, const Firmness& f, float* present,
                   float* stiffness) {
  const DF d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), full = hn::Set(d, f.full);
  const auto per_way = hn::Set(d, 1 / f.half_voxel);
  const auto shallow = hn::Set(d, f.shallow), rise = hn::Set(d, f.rise);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t live = count - i;
    const auto deep = load_n(d, depth + i, live);
    const auto way = hn::Min(hn::Max(hn::Mul(deep, per_way), zero), one);
    const auto there = hn::Max(hn::Max(deep, load_n(d, present + i, live)), zero);
    store_n(hn::Min(there, full), d, present + i, live);
    store_n(hn::MulAdd(hn::Mul(rise, way), way, shallow), d, stiffness + i, live);
  }
}

void torque_simd(const ContactColumns& c, float l0, float lever, float* tx, float* ty, float* tz) {
  const DF d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), l2 = hn::Set(d, l0 * l0);
  const auto fixed = hn::Set(d, lever > 0 ? 1 / lever : 0.0f);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    const Axis<DF> a = axis_at(d, c, i);
    auto scale = fixed;
    if (!(lever > 0)) {
      auto length2 = hn::MulAdd(a.v[3], a.v[3], l2);
      length2 = hn::MulAdd(a.v[4], a.v[4], length2);
      length2 = hn::MulAdd(a.v[5], a.v[5], length2);
      scale = hn::IfThenElseZero(hn::Gt(length2, zero), hn::Div(one, hn::Sqrt(length2)));
    }
    store_n(hn::Mul(a.v[3], scale), d, tx + i, live);
    store_n(hn::Mul(a.v[4], scale), d, ty + i, live);
    store_n(hn::Mul(a.v[5], scale), d, tz + i, live);
  }
}

void depths_simd(const float* depth, std::size_t count, Depths& out) {
  const DF d;
  const auto zero = hn::Zero(d);
  auto deepest = zero;
  std::size_t inside = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto deep = load_n(d, depth + i, count - i);
    inside += hn::CountTrue(d, hn::Gt(deep, zero));
    deepest = hn::Max(deepest, deep);
  }
  out = {inside, hn::GetLane(hn::MaxOfLanes(d, deepest))};
}

void gap_simd(const ContactColumns& c, const float* depth, double beta, const double* u, float* e) {
  const DD d;
  const hn::Rebind<float, DD> df;
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    const Axis<DD> a = axis_at(d, c, i);
    auto approach = hn::Mul(a.v[0], hn::Set(d, u[0]));
    for (int k = 1; k < 6; ++k) approach = hn::MulAdd(a.v[k], hn::Set(d, u[k]), approach);
    const auto gap = hn::NegMulAdd(hn::Set(d, beta), approach, column_at(d, depth, i, live));
    store_n(hn::DemoteTo(df, gap), df, e + i, live);
  }
}

void loads_simd(const SeriesLoads& c, float touch) {
  const DF d;
  const auto whole = hn::Set(d, touch);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    const auto u = load_n(d, c.slack + i, live);
    auto kappa = load_n(d, c.kappa + i, live);
    kappa = hn::IfThenElse(hn::Lt(u, whole), hn::Mul(kappa, hn::Div(u, whole)), kappa);
    const auto slack = hn::Sub(u, hn::Mul(hn::Set(d, 0.5f), hn::Min(u, whole)));
    const auto force = hn::Mul(kappa, slack);
    const auto deep = load_n(d, c.depth + i, live);
    const auto share = hn::IfThenElseZero(hn::Gt(deep, hn::Zero(d)), hn::Div(force, deep));
    store_n(kappa, d, c.kappa + i, live);
    store_n(slack, d, c.slack + i, live);
    store_n(force, d, c.load + i, live);
    store_n(share, d, c.weight + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(facing_simd);
HWY_EXPORT(directions_simd);
HWY_EXPORT(firmness_simd);
HWY_EXPORT(torque_simd);
HWY_EXPORT(depths_simd);
HWY_EXPORT(gap_simd);
HWY_EXPORT(loads_simd);

void contact_facing(const ContactColumns& c, float edge, float* facing) {
  HWY_DYNAMIC_DISPATCH(facing_simd)(c, edge, facing);
}
void push_directions(const ContactColumns& c, const Crosses* crosses, float* nx, float* ny,
                     float* nz, float* facing) {
  HWY_DYNAMIC_DISPATCH(directions_simd)(c, crosses, nx, ny, nz, facing);
}
void firmness(const float* depth, std::size_t count, const Firmness& f, float* present,
              float* stiffness) {
  HWY_DYNAMIC_DISPATCH(firmness_simd)(depth, count, f, present, stiffness);
}
void torque_directions(const ContactColumns& c, float l0, float lever, float* tx, float* ty,
                       float* tz) {
  HWY_DYNAMIC_DISPATCH(torque_simd)(c, l0, lever, tx, ty, tz);
}
Depths look_at_depths(const float* depth, std::size_t count) {
  Depths out;
  HWY_DYNAMIC_DISPATCH(depths_simd)(depth, count, out);
  return out;
}
void series_gap(const ContactColumns& c, const float* depth, double beta, const double u[6],
                float* e) {
  HWY_DYNAMIC_DISPATCH(gap_simd)(c, depth, beta, u, e);
}
void series_loads(const SeriesLoads& c, float touch) { HWY_DYNAMIC_DISPATCH(loads_simd)(c, touch); }

}  // namespace h6::kernels
#endif
