// SPDX-License-Identifier: Apache-2.0
// series_solve.cpp - the SIMD twin of series_solve_ref.cpp.
//
// Lanes are doubles: the load of a dense patch is a small difference of e and J.y in every contact.
// The first pass divides kappa out. A pass reads eight columns and adds to 28 sums, or to 7 when
// the solution is likely reached: then it also writes the slack and is the last. Most contacts
// within the margin carry no load; a test in float, with room for rounding, skips them and changes
// no bit. When there are many contacts and the start is far off, a sample of them is solved first.
// Passes run in slices of the contacts.
#include "kernels/weights/series_solve.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/series_solve.cpp"
#include "kernels/simd.h"
#include "kernels/weights/series_newton.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DD = hn::ScalableTag<double>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;

constexpr float kDoubt = 1e-5f;  // a hundred times the rounding of a sum of some ten floats
constexpr std::size_t kManyToStart = 256;  // fewest contacts for which a start is worth its time
// Where the first step is longer than this share of the largest e, the start was far off.
constexpr double kFar = 0.2;
constexpr std::size_t kLeastSlice = 1024;  // contacts of a slice, 2.5 us where all carry load
constexpr std::size_t kMostSlices = 32;
constexpr std::size_t kSliceStep = 128;  // 16 vectors: every slice begins with a sampled one

HWY_INLINE VD load_column(const float* column, std::size_t first, std::size_t live) {
  return hn::PromoteTo(DD(), load_n(DF(), column + first, live));
}

// Scaled axes of the contacts from `i` on; zero past the end.
struct Axes {
  VD v[6];
};
HWY_INLINE Axes axes_at(const SeriesColumns& c, VD per_lever, std::size_t i) {
  const std::size_t live = c.count - i;
  const VD nx = load_column(c.nx, i, live), ny = load_column(c.ny, i, live);
  const VD nz = load_column(c.nz, i, live);
  const VD rx = hn::Mul(load_column(c.rx, i, live), per_lever);
  const VD ry = hn::Mul(load_column(c.ry, i, live), per_lever);
  const VD rz = hn::Mul(load_column(c.rz, i, live), per_lever);
  return {{nx, ny, nz, hn::NegMulAdd(rz, ny, hn::Mul(ry, nz)),
           hn::NegMulAdd(rx, nz, hn::Mul(rz, nx)), hn::NegMulAdd(ry, nx, hn::Mul(rx, ny))}};
}

HWY_INLINE VD slack_at(const SeriesColumns& c, const Axes& J, std::size_t i, const double* y) {
  const DD d;
  VD u = load_column(c.e, i, c.count - i);
  for (int k = 0; k < 6; ++k) u = hn::NegMulAdd(J.v[k], hn::Set(d, y[k]), u);
  return u;
}

// The slack in float, to skip contacts quickly.
struct Glance {
  float y[6];  // torque components divided by the lever
  float doubt;
  Glance(const double* at, double lever) {
    double size = 0;
    for (int k = 0; k < 6; ++k) {
      y[k] = static_cast<float>(k < 3 ? at[k] : at[k] / lever);
      size += std::fabs(at[k]);
    }
    doubt = static_cast<float>(kDoubt * 2 * size);
  }
};

// False when no contact of the vector at `i` has slack, by more than the rounding of float. An axis
// is at most (1, |r| / L) long and |r| at most L, so the rounded terms sum to less than 2 |y|.
HWY_INLINE bool may_carry(const SeriesColumns& c, const Glance& g, std::size_t i) {
  const DF d;
  const std::size_t live = c.count - i;
  const auto load = [&](const float* column) HWY_ATTR { return load_n(d, column + i, live); };
  const auto e = load(c.e), nx = load(c.nx), ny = load(c.ny), nz = load(c.nz);
  const auto rx = load(c.rx), ry = load(c.ry), rz = load(c.rz);
  const auto y = [&](int k) HWY_ATTR { return hn::Set(d, g.y[k]); };
  // (r x N).y = N.(y x r)
  const auto sx = hn::NegMulAdd(y(5), ry, hn::MulAdd(y(4), rz, y(0)));
  const auto sy = hn::NegMulAdd(y(3), rz, hn::MulAdd(y(5), rx, y(1)));
  const auto sz = hn::NegMulAdd(y(4), rx, hn::MulAdd(y(3), ry, y(2)));
  auto u = hn::NegMulAdd(nx, sx, hn::MulAdd(hn::Abs(e), hn::Set(d, kDoubt), e));
  u = hn::NegMulAdd(nz, sz, hn::NegMulAdd(ny, sy, u));
  // A NaN counts as slack.
  return !hn::AllTrue(d, hn::Lt(u, hn::Set(d, -g.doubt)));
}

// kappa_i from the axes J.
HWY_INLINE hn::Vec<DF> stiffness_at(const SeriesColumns& c, VD per_c, const Axes& J,
                                    std::size_t i) {
  const DD d;
  VD a = hn::Mul(J.v[0], J.v[0]);
  for (int k = 1; k < 6; ++k) a = hn::MulAdd(J.v[k], J.v[k], a);
  const VD soft = hn::NegMulAdd(hn::Min(a, hn::Set(d, 2.0)), per_c, hn::Set(d, 1.0));
  const VD facing = c.facing != nullptr ? load_column(c.facing, i, c.count - i) : hn::Set(d, 1.0);
  return hn::DemoteTo(DF(), hn::Div(facing, soft));
}

// A contact's response to its slack u >= 0, without kappa: p, p' and 2 P of series_solve.h.
struct Response {
  VD load, stiffness, twice_energy;
};
HWY_INLINE Response respond(VD u, VD touch) {
  const DD d;
  const VD below = hn::Min(u, touch), above = hn::Sub(u, below);
  // Where touch is 0 no slack is below it.
  const VD share = hn::IfThenElse(hn::Lt(u, touch), hn::Div(u, touch), hn::Set(d, 1.0));
  const VD part = hn::Mul(share, below);
  return {hn::MulAdd(hn::Set(d, 0.5), part, above), share,
          hn::MulAdd(hn::Set(d, 1.0 / 3), hn::Mul(part, below), hn::Mul(above, u))};
}

// Options of a pass over the contacts, which always sums pull and energy.
enum Pass : int {
  kStiffen = 1,  // fills kappa, and finds the largest e of a contact that can carry load, or 0
  kSystem = 2,
  kSlack = 4,  // fills slack
};

// One pass over one vector in `stride` of the contacts. Returns the largest e.
template <int kPass>
HWY_NOINLINE double pass_slice(const SeriesColumns& c, const SeriesParameters& p, const double* y,
                               float* kappa, float* slack, SeriesSums& out,
                               std::size_t stride = 1) {
  const DD d;
  const VD zero = hn::Zero(d), per_lever = hn::Set(d, 1 / p.lever), per_c = hn::Set(d, 1 / p.c);
  const VD touch = hn::Set(d, p.touch);
  VD system[kUpper6], pull[6], energy = zero, max_e = zero;
  for (int k = 0; k < kUpper6; ++k) system[k] = zero;
  for (int k = 0; k < 6; ++k) pull[k] = zero;
  const Glance glance(y, p.lever);
  for (std::size_t i = 0; i < c.count; i += stride * hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    if constexpr (!(kPass & kStiffen)) {
      if (!may_carry(c, glance, i)) {
        if constexpr (kPass & kSlack) store_n(hn::Zero(DF()), DF(), slack + i, live);
        continue;
      }
    }
    const Axes J = axes_at(c, per_lever, i);
    const VD u = slack_at(c, J, i, y);
    hn::Vec<DF> k;
    if constexpr (kPass & kStiffen) {
      k = stiffness_at(c, per_c, J, i);
      store_n(k, DF(), kappa + i, live);
      const auto carries = hn::Gt(k, hn::Zero(DF()));
      const auto e = hn::IfThenElseZero(carries, load_n(DF(), c.e + i, live));
      max_e = hn::Max(max_e, hn::PromoteTo(d, e));
    }
    if constexpr (kPass & kSlack)
      store_n(hn::DemoteTo(DF(), hn::Max(u, zero)), DF(), slack + i, live);
    const auto active = hn::Gt(u, zero);  // not where u is NaN
    if (hn::AllFalse(d, active)) continue;
    if constexpr (!(kPass & kStiffen)) k = load_n(DF(), kappa + i, live);
    const VD w = hn::IfThenElseZero(active, hn::PromoteTo(d, k));
    const Response response = respond(hn::IfThenElseZero(active, u), touch);
    const VD load = hn::Mul(w, response.load), stiffness = hn::Mul(w, response.stiffness);
    energy = hn::MulAdd(w, response.twice_energy, energy);
    int entry = 0;
    HWY_UNROLL(8)
    for (int row = 0; row < 6; ++row) {
      pull[row] = hn::MulAdd(load, J.v[row], pull[row]);
      if constexpr (kPass & kSystem) {
        const VD wJ = hn::Mul(stiffness, J.v[row]);
        for (int col = row; col < 6; ++col, ++entry)
          system[entry] = hn::MulAdd(wJ, J.v[col], system[entry]);
      }
    }
  }
  if constexpr (kPass & kSystem)
    for (int k = 0; k < kUpper6; ++k) out.system[k] = hn::GetLane(hn::SumOfLanes(d, system[k]));
  for (int k = 0; k < 6; ++k) out.pull[k] = hn::GetLane(hn::SumOfLanes(d, pull[k]));
  out.energy = hn::GetLane(hn::SumOfLanes(d, energy));
  return hn::GetLane(hn::MaxOfLanes(d, max_e));
}

// A solve: what its passes read, and what they write for each contact.
struct Solve {
  const SeriesColumns& contacts;
  float *kappa, *slack;
  const SliceRunner& run_slices;
};

SeriesColumns slice_of(const SeriesColumns& c, std::size_t begin, std::size_t count) {
  return {
      c.nx + begin, c.ny + begin, c.nz + begin, c.rx + begin,
      c.ry + begin, c.rz + begin, c.e + begin,  c.facing == nullptr ? nullptr : c.facing + begin,
      count};
}

void add_sums(const SeriesSums& some, SeriesSums& to) {
  for (int k = 0; k < kUpper6; ++k) to.system[k] += some.system[k];
  for (int k = 0; k < 6; ++k) to.pull[k] += some.pull[k];
  to.energy += some.energy;
}

// pass_slice over all slices. `out` is zero before.
template <int kPass>
double pass(const Solve& solve, const SeriesParameters& p, const double* y, SeriesSums& out,
            std::size_t stride = 1) {
  const SeriesColumns& c = solve.contacts;
  const std::size_t even = (c.count + kMostSlices - 1) / kMostSlices;
  const std::size_t each = std::max(kLeastSlice, (even + kSliceStep - 1) / kSliceStep * kSliceStep);
  if (c.count <= each) return pass_slice<kPass>(c, p, y, solve.kappa, solve.slack, out, stride);
  SeriesSums sums[kMostSlices];
  double max_e[kMostSlices];
  auto work = [&](std::size_t i) {
    const std::size_t begin = i * each;
    max_e[i] = pass_slice<kPass>(slice_of(c, begin, std::min(each, c.count - begin)), p, y,
                                 solve.kappa + begin, solve.slack + begin, sums[i], stride);
  };
  const std::size_t slices = (c.count + each - 1) / each;
  solve.run_slices(slices, work);
  double largest = 0;
  for (std::size_t i = 0; i < slices; ++i) {
    largest = std::max(largest, max_e[i]);
    add_sums(sums[i], out);
  }
  return largest;
}

// Computes a start from a sample of the contacts. Each sampled contact represents several, so the
// spring is made softer instead of the contacts stiffer.
void start_from_some(const Solve& solve, const SeriesParameters& p, double* y, std::size_t stride) {
  SeriesParameters softer = p;
  softer.c = p.c / static_cast<double>(stride);
  softer.tolerance = 1e-2;
  SeriesSums first;
  const double max_e = pass<kStiffen | kSystem>(solve, p, y, first, stride);
  if (!(max_e > 0)) return;
  newton(softer, max_e, y, first, [&](const double* at, bool) {
    SeriesSums sums;
    pass<kSystem>(solve, p, at, sums, stride);
    return sums;
  });
  check_start(y);
}

void series_solve_simd(const SeriesColumns& contacts, const SeriesParameters& p, double* y,
                       float* kappa, float* slack, const SliceRunner& run_slices,
                       SeriesResult& result) {
  const Solve solve{contacts, kappa, slack, run_slices};
  result = {0, 0};
  check_start(y);
  const bool many = contacts.count >= kManyToStart;
  bool far = many && norm2(y) == 0;
  SeriesSums first;
  double max_e = far ? 0 : pass<kStiffen | kSystem>(solve, p, y, first);
  if (many && max_e > 0) {
    double step[6];
    newton_step(p.c, first, y, step);
    far = norm2(step) > kFar * kFar * max_e * max_e;
  }
  if (far) {
    for (const std::size_t stride : {16, 4}) start_from_some(solve, p, y, stride);
    first = {};
    max_e = pass<kStiffen | kSystem>(solve, p, y, first);
  }
  bool filled = false;  // slack is that of y
  if (max_e > 0) {
    const bool apart = slack != contacts.e;
    result = newton(p, max_e, y, first, [&](const double* at, bool system) {
      SeriesSums sums;
      filled = !system && apart;
      if (system) {
        pass<kSystem>(solve, p, at, sums);
      } else if (apart) {
        pass<kSlack>(solve, p, at, sums);
      } else {
        pass<0>(solve, p, at, sums);
      }
      return sums;
    });
  } else {
    for (int k = 0; k < 6; ++k) y[k] = 0;  // no contact has load
  }
  if (filled) return;
  SeriesSums unused;
  pass<kSlack>(solve, p, y, unused);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(series_solve_simd);

SeriesResult series_solve(const SeriesColumns& contacts, const SeriesParameters& parameters,
                          double y[6], float* kappa, float* slack, const SliceRunner& run_slices) {
  SeriesResult result;
  HWY_DYNAMIC_DISPATCH(series_solve_simd)
  (contacts, parameters, y, kappa, slack, run_slices, result);
  return result;
}

}  // namespace h6::kernels
#endif
