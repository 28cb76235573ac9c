// SPDX-License-Identifier: Apache-2.0
// friction.cpp - follows the friction spring of each pair, lets it slip, and sums its wrench.
#include "runtime/contact/friction.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "runtime/base/solve_positive.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

// The spring yields until this share of the load slips. It is below 1 because a contact on the axis
// of a spin never slips. METHOD.md, Sec. 9.
constexpr double kSlipping = 0.95;
constexpr int kYieldSteps = 4;  // of Newton's method
// Components of the stretch that no contact feels fade; the others keep all but this share in a
// step.
constexpr double kFade = 1e-12;

Vec6 rotated(const Mat3& R, const Vec6& q) {
  Vec6 out;
  out << R * q.head<3>(), R * q.tail<3>();
  return out;
}

// The energy that the bodies put into the spring by the motion `moved` of the last step, in which
// the spring's end was at q. An implicit step has the force and the damper of its end. For other
// steps the spring alone counts, as if time were continuous.
double put_in(const FrictionSpring& spring, const Vec6& q, const Vec6& moved) {
  const double along = spring.implicit ? 1 + spring.damping : 0.5;
  return moved.dot(spring.K * (q + along * moved));
}

// The relative motion since the last step, in the axes of b. The spring then stands at the present
// poses.
Vec6 follow(FrictionSpring& spring, const Body& a, const Body& b) {
  const Vec3 X = b.R.transpose() * (a.x - b.x);
  const Quat Q = b.q.conjugate() * a.q;
  Vec6 moved = Vec6::Zero();
  if (spring.holds) {
    moved << X - spring.X, log_rotation(Q * spring.Q.conjugate());
    spring.energy += put_in(spring, rotated(spring.Rb, spring.q), rotated(spring.Rb, moved));
  }
  spring.holds = true;
  spring.Rb = b.R, spring.Q = Q, spring.X = X;
  spring.q += moved;
  return moved;
}

// A contact's normal force over k; that of `series` includes damping already.
double normal_load(const Contacts& c, const h6ContactDef& def, const Vec6& u, std::size_t i) {
  if (uses_series(def)) return c.load[i];
  const Vec3 n(c.nx[i], c.ny[i], c.nz[i]), r(c.rx[i], c.ry[i], c.rz[i]);
  const double leaves = n.dot(u.head<3>() + u.tail<3>().cross(r));
  return double{c.weight[i]} * std::max(0.0, double{c.depth[i]} - def.damping * leaves);
}

void add(kernels::FrictionSums& to, const kernels::FrictionSums& more) {
  to.stretched += more.stretched, to.linear += more.linear, to.capped += more.capped;
  to.sticking += more.sticking, to.energy += more.energy;
  to.slips = to.slips || more.slips;
}

// The rows of a pair, slice by slice of its contacts. Each slice has its own part of the scratch,
// and results of slices are joined in order.
class SlicedRows {
 public:
  SlicedRows(const Contacts& c, const h6ContactDef& def, const Pair& pair, const Vec6& u,
             Lane& lane)
      : lane_(lane), count_(pair.end - pair.begin) {
    each([&](std::size_t i) {
      const std::size_t begin = pair.begin + i * kRubSlice;
      rows_that_rub(c, def, u, begin, std::min(begin + kRubSlice, pair.end), i);
    });
    for (std::size_t i = 0; i < slices(); ++i) total_ += scratch().slice[i].total;
  }
  double total() const { return total_; }
  FrictionRows<float> of(std::size_t i) const {
    FrictionRows<float> rows = scratch().slice[i];
    rows.total = total_;
    return rows;
  }
  std::size_t slices() const { return (count_ + kRubSlice - 1) / kRubSlice; }
  const FrictionScratch& scratch() const { return lane_.scratch->friction; }
  // Calls run(i) for every slice, on any thread.
  template <class F>
  void each(F&& run) const {
    share_slices(lane_, lane_.rubbing, count_, slices(), run);
  }

  // Stretches the rows by q. Returns at(1).
  kernels::FrictionSums stretch(const Vec6& q) const {
    const FrictionScratch& s = scratch();
    return sums_of([&](std::size_t i) {
      for (const kernels::FrictionRows* some : {&s.slice[i].planes, &s.slice[i].lines})
        if (some->count > 0) kernels::friction_stretch(*some, q.data(), stretch_of(*some));
      return sums(i, 1);
    });
  }
  // Sums over the rows when each has `share` of its stretch.
  kernels::FrictionSums at(double share) const {
    return sums_of([&](std::size_t i) { return sums(i, share); });
  }
  // The share, 0 .. 1, of its stretch that the spring keeps. `whole`: at(1).
  double yield(const kernels::FrictionSums& whole) const {
    // Rows along a line that are on their way back have no say.
    const double most = total_ * whole.stretched;
    if (!(whole.linear > most)) return 1;
    // The share of the load that slips is concave in the share of the stretch, so Newton's method
    // comes from below.
    double share = kSlipping * most / whole.linear;
    for (int step = 0; step < kYieldSteps; ++step) {
      const kernels::FrictionSums now = at(share);
      const double slips = now.capped / most, slope = now.sticking / (share * most);
      if (!(slope > 0) || !(slips < kSlipping)) break;
      share += (kSlipping - slips) / slope;
    }
    return std::min(1.0, share / kSlipping);
  }

 private:
  void rows_that_rub(const Contacts& c, const h6ContactDef& def, const Vec6& u, std::size_t begin,
                     std::size_t end, std::size_t i) const {
    const FrictionScratch& s = scratch();
    const kernels::ContactColumns at = kernel_columns(c, begin, end);
    const std::size_t first = i * kRubSlice;
    FrictionRows<float>& rows = s.slice[i];
    rows = {};
    float* load = s.load + first;
    if (def.friction > 0) {
      rows.planes = {at.nx, at.ny, at.nz, at.rx, at.ry, at.rz, load, at.count, false};
      for (std::size_t k = 0; k < at.count; ++k) {
        const double most = def.friction * normal_load(c, def, u, begin + k);
        load[k] = most > 0 ? static_cast<float>(most) : 0;
        rows.total += load[k];
      }
      load += count_;
    }
    if (pushes_rub(def)) {
      float* to[6];
      for (int k = 0; k < 6; ++k) to[k] = s.line[k] + first;
      const kernels::PushLineRows lines =
          kernels::push_lines(at, c.load + begin, {to[0], to[1], to[2], to[3], to[4], to[5], load});
      rows.lines = {to[0], to[1], to[2], to[3], to[4], to[5], load, lines.count, true};
      rows.total += lines.total;
    }
  }
  double* stretch_of(const kernels::FrictionRows& some) const {
    return scratch().stretch + (some.load - scratch().load);
  }
  kernels::FrictionSums sums(std::size_t i, double share) const {
    kernels::FrictionSums out{};
    for (const kernels::FrictionRows* some :
         {&scratch().slice[i].planes, &scratch().slice[i].lines})
      if (some->count > 0)
        add(out, kernels::friction_sums(some->load, stretch_of(*some), some->count, share, total_));
    return out;
  }
  template <class F>
  kernels::FrictionSums sums_of(const F& sums_of_slice) const {
    each([&](std::size_t i) { scratch().sums[i] = sums_of_slice(i); });
    kernels::FrictionSums out{};
    for (std::size_t i = 0; i < slices(); ++i) add(out, scratch().sums[i]);
    return out;
  }

  Lane& lane_;
  std::size_t count_;
  double total_ = 0;
};

// K of all rows, as friction_stiffness has it of some.
void stiffness_of(const SlicedRows& rows, const FrictionLaw& law, const Vec6& q, const Vec6& ahead,
                  Mat6& K) {
  Mat6* const of = rows.scratch().K;
  rows.each([&](std::size_t i) { friction_stiffness(rows.of(i), law, q, ahead, of[i]); });
  clear(K);
  for (std::size_t i = 0; i < rows.slices(); ++i) K += of[i];
}

// Lets the spring slip, and keeps its energy within what was put in. `q`: in world axes.
void slip(const SlicedRows& rows, const FrictionLaw& law, FrictionSpring& spring, Vec6& q) {
  kernels::FrictionSums sums = rows.stretch(q);
  double share = rows.yield(sums);
  if (share < 1) sums = rows.at(share);
  const double most = std::max(spring.energy, 0.0);
  double stored = law.stiffness / law.limit * sums.energy;
  if (stored > most) {
    // Where rows slip the energy grows less than with the square, but at least in proportion.
    const double ratio = most / stored;
    share *= sums.slips ? ratio : std::sqrt(ratio);
    stored = most;
  }
  q *= share;
  // The account never holds more than the spring can at its limit.
  spring.energy = std::min(most, std::max(stored, 0.5 * law.stiffness * law.limit * law.limit));
}

// Removes from q what no contact feels, such as the turn of a wheel that rolls.
void forget_unfelt(const Mat6& K, double stiffness, double lever, Vec6& q) {
  Vec6 least;
  least.head<3>().setConstant(kFade * stiffness);
  least.tail<3>().setConstant(kFade * stiffness * lever * lever);
  Mat6 A;
  A.topRows<3>() = K.topRows<3>(), A.bottomRows<3>() = K.bottomRows<3>();
  A.diagonal() += least;
  Vec6 unfelt;
  if (solve_positive(A, Vec6(least.cwiseProduct(q)), unfelt)) q -= unfelt;
}

bool moves_in_step(const Body& body) { return !body.fixed && body.motion != Motion::held; }
bool has_mass(const Body& body) { return !body.fixed && body.motion == Motion::dynamic; }

void sum_pair(const Settings& set, const Body& a, const Body& b, const Vec6& u,
              const SlicedRows& rows, FrictionSpring& spring) {
  const FrictionLaw law{set.contact.stiffness, rows.total()};
  const Vec6 moved = follow(spring, a, b);
  Vec6 q = rotated(b.R, spring.q);
  slip(rows, law, spring, q);
  const Vec6 damped = q + set.contact.damping * u;
  const bool mass = has_mass(a) || has_mass(b);
  spring.implicit = set.integrator == H6_IMPLICIT && (moves_in_step(a) || moves_in_step(b));
  spring.damping = mass ? set.contact.damping / set.dt : 0;
  // An implicit step goes on about as fast as the bodies are; those without mass, as the last one.
  Vec6 ahead = damped;
  if (spring.implicit) ahead += mass ? Vec6(set.dt * u) : rotated(b.R, moved);
  stiffness_of(rows, law, q, ahead, spring.K);
  spring.f = -(spring.K * damped);
  if (set.gradient == H6_EXACT) {
    spring.elastic = -(spring.K * q);
    spring.turning.setZero();
    for (std::size_t i = 0; i < rows.slices(); ++i)
      spring.turning += friction_turning(rows.of(i), law, q, ahead);
  }
  forget_unfelt(spring.K, law.stiffness, series_lever(a.radius, a.voxel), q);
  spring.q = rotated(b.R.transpose(), q);
  if (!spring.q.allFinite() || !spring.f.allFinite()) spring = {};
}

// How the wrenches change with the poses beyond K: the springs lie in the field's axes, so only a
// common turn of both bodies turns the force.
void add_turning(const Sides& sides, const Mat6& S, Pair& pair, const FrictionSpring& spring) {
  const Mat3 F = cross_matrix(spring.elastic.head<3>());
  Mat6 by_b = -spring.turning * S.transpose();
  by_b.topRightCorner<3, 3>() -= F;
  by_b.bottomRightCorner<3, 3>() -= cross_matrix(spring.elastic.tail<3>());
  if (!sides.a.fixed) sides.on_a.K += spring.turning;
  if (!sides.b.fixed) {
    sides.on_b.K -= S * by_b;
    sides.on_b.K.bottomLeftCorner<3, 3>() -= F;
  }
  if (!pair.between) return;
  pair.between->Kab += by_b;
  pair.between->Kba -= S * spring.turning;
  pair.between->Kba.bottomLeftCorner<3, 3>() += F;
}

Vec6 velocity_of(const Body& body) {
  Vec6 u;
  u << body.v, body.w;
  return u;
}

// The solve takes a body that it does not move for standing still. The spring, which sticks, must
// go along with an obstacle that a program or a hand moves, so its wrench gets that part
// beforehand.
void lead(const Settings& set, const Sides& sides, const Mat6& K) {
  const Body &a = sides.a, &b = sides.b;
  if (set.integrator != H6_IMPLICIT || has_mass(a) == has_mass(b)) return;
  const Body& obstacle = has_mass(a) ? b : a;
  if (obstacle.v.isZero(0) && obstacle.w.isZero(0)) return;
  const Mat6 S = arm_shift(a, b);
  if (has_mass(a)) sides.on_a.f += set.dt * (K * (S.transpose() * velocity_of(b)));
  if (has_mass(b)) sides.on_b.f += set.dt * (S * (K * velocity_of(a)));
}

// ---- one row after the other, for the derivatives

struct Row {
  Vec3 n, r;
  bool line;
};
template <class T>
Row row_at(const kernels::FrictionRowsT<T>& c, std::size_t i) {
  const Vec3 n(c.nx[i], c.ny[i], c.nz[i]);
  // A step of Newton's method makes the unit vector of floats one of doubles.
  return {(1.5 - 0.5 * n.squaredNorm()) * n, Vec3(c.rx[i], c.ry[i], c.rz[i]), c.lines};
}
Vec3 moved_at(const Row& row, const Vec6& q) { return q.head<3>() + q.tail<3>().cross(row.r); }
// How far the motion q stretches a row. Along a line the way back is free.
Vec3 stretched(const Row& row, const Vec6& q) {
  const Vec3 moved = moved_at(row, q);
  const double along = row.n.dot(moved);
  return row.line ? Vec3(std::max(along, 0.0) * row.n) : Vec3(moved - along * row.n);
}

// A row's friction over its stretch is the load's share of the stiffness up to the limit, and falls
// with the stretch beyond it. The larger of the stretches now and at the end of the step counts:
// METHOD.md, Sec. 9, needs the first for passivity.
template <class T>
kernels::FrictionSecant secant_of(const FrictionRows<T>& rows, const FrictionLaw& law) {
  return {law.stiffness * law.limit / rows.total, law.limit};
}

}  // namespace

template <class T>
void friction_stiffness(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                        const Vec6& ahead, Mat6& K) {
  const kernels::FrictionSecant secant = secant_of(rows, law);
  clear(K);
  for (const kernels::FrictionRowsT<T>* some : {&rows.planes, &rows.lines}) {
    if (some->count == 0) continue;
    if constexpr (std::is_same_v<T, float>)
      kernels::friction_stiffness(*some, secant, q.data(), ahead.data(), K.data());
    else
      kernels::friction_stiffness_ref(*some, secant, q.data(), ahead.data(), K.data());
  }
}

template <class T>
Mat6 friction_turning(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                      const Vec6& ahead) {
  const kernels::FrictionSecant secant = secant_of(rows, law);
  const Mat3 turn = cross_matrix(q.tail<3>());
  Mat3 force = Mat3::Zero(), torque = Mat3::Zero();
  for (const kernels::FrictionRowsT<T>* some : {&rows.planes, &rows.lines}) {
    for (std::size_t i = 0; i < some->count; ++i) {
      const Row row = row_at(*some, i);
      const Vec3 &n = row.n, &r = row.r, moved = moved_at(row, q);
      if (!(some->load[i] > 0) || (row.line && n.dot(moved) < 0)) continue;
      const double z = std::max(stretched(row, q).norm(), stretched(row, ahead).norm());
      const double s = secant.scale * some->load[i] / std::max(secant.limit, z);
      const Mat3 arm = cross_matrix(r), arms_turn = turn * arm;
      const Mat3 by_axis = n * (n.transpose() * arms_turn) + n.dot(moved) * cross_matrix(n) -
                           n * n.cross(moved).transpose();
      const Mat3 by_turn = s * (row.line ? by_axis : Mat3(arms_turn - by_axis));
      force += by_turn;
      torque += arm * by_turn - s * cross_matrix(stretched(row, q)) * arm;
    }
  }
  Mat6 out = Mat6::Zero();
  out.topRightCorner<3, 3>() = force;
  out.bottomRightCorner<3, 3>() = torque;
  return out;
}

template void friction_stiffness(const FrictionRows<float>&, const FrictionLaw&, const Vec6&,
                                 const Vec6&, Mat6&);
template void friction_stiffness(const FrictionRows<double>&, const FrictionLaw&, const Vec6&,
                                 const Vec6&, Mat6&);
template Mat6 friction_turning(const FrictionRows<float>&, const FrictionLaw&, const Vec6&,
                               const Vec6&);
template Mat6 friction_turning(const FrictionRows<double>&, const FrictionLaw&, const Vec6&,
                               const Vec6&);

bool pushes_rub(const h6ContactDef& def) { return def.method == H6_METHOD_FIRM; }
bool contacts_rub(const h6ContactDef& def) { return def.friction > 0 || pushes_rub(def); }
std::size_t rows_of_contact(const h6ContactDef& def) {
  return std::size_t{def.friction > 0} + std::size_t{pushes_rub(def)};
}

void sum_friction(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  const Body& a = bodies[shell.body];
  for (Pair& pair : shell.pairs) {
    if (!pair.friction) continue;
    FrictionSpring& spring = *pair.friction;
    const Body& b = bodies[pair.b];
    const Vec6 u = pair_velocity(a, b);
    const SlicedRows rows(shell.contacts, set.contact, pair, u, lane);
    if (rows.total() > 0)
      sum_pair(set, a, b, u, rows, spring);
    else if (spring.holds)
      spring = {};
  }
}

void add_friction(const Settings& set, const Sides& sides, Pair& pair,
                  const FrictionSpring& spring) {
  if (!spring.holds) return;
  const Mat6& K = spring.K;
  const double beta = set.contact.damping;
  if (!sides.a.fixed) sides.on_a.f += spring.f, sides.on_a.K -= K, sides.on_a.D -= beta * K;
  lead(set, sides, K);
  if (sides.b.fixed && !pair.between && set.gradient != H6_EXACT) return;
  const Mat6 S = arm_shift(sides.a, sides.b), KS = K * S.transpose();
  if (!sides.b.fixed) {
    const Mat6 SKS = S * KS;
    sides.on_b.f -= S * spring.f, sides.on_b.K -= SKS, sides.on_b.D -= beta * SKS;
  }
  if (pair.between) {
    const Mat6 SK = S * K;
    pair.between->Kab += KS, pair.between->Dab += beta * KS;
    pair.between->Kba += SK, pair.between->Dba += beta * SK;
  }
  if (set.gradient == H6_EXACT) add_turning(sides, S, pair, spring);
}

}  // namespace h6
