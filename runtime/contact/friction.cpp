// SPDX-License-Identifier: Apache-2.0
// friction.cpp - follows the friction spring of each pair, lets it slip, and sums its wrench.
#include "runtime/contact/friction.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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

struct Row {
  Vec3 n, r;
  bool line;
};
template <class T>
Row row_at(const FrictionRows<T>& c, std::size_t i) {
  const Vec3 n(c.nx[i], c.ny[i], c.nz[i]);
  // A step of Newton's method makes the unit vector of floats one of doubles.
  return {(1.5 - 0.5 * n.squaredNorm()) * n, Vec3(c.rx[i], c.ry[i], c.rz[i]), i >= c.planes};
}

Vec3 moved_at(const Row& row, const Vec6& q) { return q.head<3>() + q.tail<3>().cross(row.r); }
double along(const Row& row, const Vec6& q) { return row.n.dot(moved_at(row, q)); }
// How far the motion q stretches a row. Along a line the way back is free.
Vec3 stretched(const Row& row, const Vec6& q) {
  if (row.line) return std::max(along(row, q), 0.0) * row.n;
  return moved_at(row, q) - along(row, q) * row.n;
}

// s: the secant of a contact's force over its stretch. It is the larger of the stretches now and at
// the end of the step that counts: METHOD.md, Sec. 9, needs the first for passivity.
template <class T>
double secant(const FrictionRows<T>& rows, const FrictionLaw& law, std::size_t i, const Row& row,
              const Vec6& q, const Vec6& ahead) {
  const double squared =
      std::max(stretched(row, q).squaredNorm(), stretched(row, ahead).squaredNorm());
  const double share = law.stiffness * rows.load[i] / rows.total;
  return squared > law.limit * law.limit ? share * law.limit / std::sqrt(squared) : share;
}

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
  const Mat3 turn = b.R.transpose();
  const Vec3 X = turn * (a.x - b.x);
  const Mat3 Q = turn * a.R;
  Vec6 moved = Vec6::Zero();
  if (spring.holds) {
    moved << X - spring.X, log_rotation(Quat(Mat3(Q * spring.Q.transpose())));
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

// The rows of a pair, in the scratch.
class RowWriter {
 public:
  RowWriter(const Contacts& c, const h6ContactDef& def, const Vec6& u, const FrictionScratch& s)
      : c_(c), def_(def), u_(u), s_(s) {}

  // A row of contact i along its plane (axis n) or a line (axis e).
  void add(std::size_t i, double mu, const Vec3& axis) {
    const double load = mu * normal_load(c_, def_, u_, i);
    if (!(load > 0)) return;
    for (int k = 0; k < 3; ++k) s_.row[k][count_] = static_cast<float>(axis[k]);
    s_.row[3][count_] = c_.rx[i], s_.row[4][count_] = c_.ry[i], s_.row[5][count_] = c_.rz[i];
    s_.load[count_++] = load;
    total_ += load;
  }
  void end_planes() { planes_ = count_; }
  FrictionRows<float> rows() const {
    return {s_.row[0], s_.row[1], s_.row[2], s_.row[3], s_.row[4],
            s_.row[5], s_.load,   count_,    total_,    planes_};
  }

 private:
  const Contacts& c_;
  const h6ContactDef& def_;
  const Vec6& u_;
  const FrictionScratch& s_;
  std::size_t count_ = 0, planes_ = 0;
  double total_ = 0;
};

FrictionRows<float> rows_that_rub(const Contacts& c, const h6ContactDef& def, const Pair& pair,
                                  const Vec6& u, const FrictionScratch& s) {
  RowWriter out(c, def, u, s);
  if (def.friction > 0)
    for (std::size_t i = pair.begin; i < pair.end; ++i)
      out.add(i, def.friction, Vec3(c.nx[i], c.ny[i], c.nz[i]));
  out.end_planes();
  if (!pushes_rub(def)) return out.rows();
  kernels::push_lean(kernel_columns(c, pair.begin, pair.end), s.lean);
  for (std::size_t i = pair.begin; i < pair.end; ++i) {
    const double mu = s.lean[i - pair.begin];
    if (!(mu > 0)) continue;
    // Along e the depth grows, while the push does no work.
    const Vec3 n(c.nx[i], c.ny[i], c.nz[i]), g(c.gx[i], c.gy[i], c.gz[i]);
    out.add(i, mu, (n * n.dot(g) - g).normalized());
  }
  return out.rows();
}

// The energy of the spring when each row has `share` of its stretch [J], and whether a row slips.
struct Stored {
  double energy = 0;
  bool slips = false;
};
Stored stored_in(const FrictionRows<float>& rows, const FrictionLaw& law, const double* stretch,
                 double share) {
  Stored sum;
  for (std::size_t i = 0; i < rows.count; ++i) {
    const double z = share * stretch[i];
    sum.slips = sum.slips || z > law.limit;
    sum.energy += rows.load[i] * (z > law.limit ? law.limit * (z - 0.5 * law.limit) : 0.5 * z * z);
  }
  sum.energy *= law.stiffness / rows.total;
  return sum;
}

// Lets the spring slip, and keeps its energy within what was put in. `q`: in world axes.
void slip(const FrictionRows<float>& rows, const FrictionLaw& law, FrictionSpring& spring, Vec6& q,
          double* stretch) {
  for (std::size_t i = 0; i < rows.count; ++i) stretch[i] = stretched(row_at(rows, i), q).norm();
  double share = friction_yield(rows, law, stretch);
  Stored stored = stored_in(rows, law, stretch, share);
  const double most = std::max(spring.energy, 0.0);
  if (stored.energy > most) {
    // Where rows slip the energy grows less than with the square, but at least in proportion.
    const double ratio = most / stored.energy;
    share *= stored.slips ? ratio : std::sqrt(ratio);
    stored.energy = most;
  }
  q *= share;
  // The account never holds more than the spring can at its limit.
  spring.energy =
      std::min(most, std::max(stored.energy, 0.5 * law.stiffness * law.limit * law.limit));
}

// Removes from q what no contact feels, such as the turn of a wheel that rolls.
void forget_unfelt(const Mat6& K, double stiffness, double lever, Vec6& q) {
  Vec6 least;
  least.head<3>().setConstant(kFade * stiffness);
  least.tail<3>().setConstant(kFade * stiffness * lever * lever);
  Mat6 A = K;
  A.diagonal() += least;
  q -= A.llt().solve(Vec6(least.cwiseProduct(q)));
}

bool moves_in_step(const Body& body) { return !body.fixed && body.motion != Motion::held; }
bool has_mass(const Body& body) { return !body.fixed && body.motion == Motion::dynamic; }

void sum_pair(const Settings& set, const Body& a, const Body& b, const Vec6& u,
              const FrictionRows<float>& rows, double* stretch, FrictionSpring& spring) {
  const FrictionLaw law{set.contact.stiffness, rows.total};
  const Vec6 moved = follow(spring, a, b);
  Vec6 q = rotated(b.R, spring.q);
  slip(rows, law, spring, q, stretch);
  const Vec6 damped = q + set.contact.damping * u;
  const bool mass = has_mass(a) || has_mass(b);
  spring.implicit = set.integrator == H6_IMPLICIT && (moves_in_step(a) || moves_in_step(b));
  spring.damping = mass ? set.contact.damping / set.dt : 0;
  // An implicit step goes on about as fast as the bodies are; those without mass, as the last one.
  Vec6 ahead = damped;
  if (spring.implicit) ahead += mass ? Vec6(set.dt * u) : rotated(b.R, moved);
  spring.K = friction_stiffness(rows, law, q, ahead);
  spring.elastic = -(spring.K * q);
  spring.f = -(spring.K * damped);
  if (set.gradient == H6_EXACT) spring.turning = friction_turning(rows, law, q, ahead);
  forget_unfelt(spring.K, law.stiffness, series_lever(a.radius, a.voxel), q);
  spring.q = rotated(b.R.transpose(), q);
  if (!spring.q.allFinite() || !spring.K.allFinite()) spring = {};
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
void lead(const Settings& set, const Sides& sides, const Mat6& S, const Mat6& K) {
  const Body &a = sides.a, &b = sides.b;
  if (set.integrator != H6_IMPLICIT || has_mass(a) == has_mass(b)) return;
  if (has_mass(a)) sides.on_a.f += set.dt * (K * (S.transpose() * velocity_of(b)));
  if (has_mass(b)) sides.on_b.f += set.dt * (S * (K * velocity_of(a)));
}

}  // namespace

template <class T>
Mat6 friction_stiffness(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                        const Vec6& ahead) {
  // In the plane J_t^T J_t is that of a spring in all directions less J J^T, J = [n; r x n]; along
  // a line it is J J^T.
  double sum = 0;
  Vec3 arms = Vec3::Zero();
  Mat3 squares = Mat3::Zero();
  Mat6 K = Mat6::Zero();
  for (std::size_t i = 0; i < rows.count; ++i) {
    const Row row = row_at(rows, i);
    if (row.line && along(row, q) < 0) continue;
    const double s = secant(rows, law, i, row, q, ahead);
    Vec6 J;
    J << row.n, row.r.cross(row.n);
    K.noalias() += (row.line ? s : -s) * J * J.transpose();
    if (row.line) continue;
    sum += s;
    arms += s * row.r;
    squares.noalias() += s * row.r * row.r.transpose();
  }
  K.topLeftCorner<3, 3>().diagonal().array() += sum;
  K.topRightCorner<3, 3>() -= cross_matrix(arms);
  K.bottomLeftCorner<3, 3>() += cross_matrix(arms);
  K.bottomRightCorner<3, 3>() += squares.trace() * Mat3::Identity() - squares;
  return K;
}

template <class T>
Mat6 friction_turning(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                      const Vec6& ahead) {
  const Mat3 turn = cross_matrix(q.tail<3>());
  Mat3 force = Mat3::Zero(), torque = Mat3::Zero();
  for (std::size_t i = 0; i < rows.count; ++i) {
    const Row row = row_at(rows, i);
    if (row.line && along(row, q) < 0) continue;
    const Vec3 &n = row.n, &r = row.r;
    const double s = secant(rows, law, i, row, q, ahead);
    const Vec3 moved = moved_at(row, q);
    const Mat3 arm = cross_matrix(r), arms_turn = turn * arm;
    const Mat3 by_axis = n * (n.transpose() * arms_turn) + n.dot(moved) * cross_matrix(n) -
                         n * n.cross(moved).transpose();
    const Mat3 by_turn = s * (row.line ? by_axis : Mat3(arms_turn - by_axis));
    force += by_turn;
    torque += arm * by_turn - s * cross_matrix(stretched(row, q)) * arm;
  }
  Mat6 out = Mat6::Zero();
  out.topRightCorner<3, 3>() = force;
  out.bottomRightCorner<3, 3>() = torque;
  return out;
}

template <class T>
double friction_yield(const FrictionRows<T>& rows, const FrictionLaw& law, const double* stretch) {
  // Rows along a line that are on their way back have no say.
  double total = 0, sum = 0;
  for (std::size_t i = 0; i < rows.count; ++i) {
    if (stretch[i] > 0) total += rows.load[i];
    sum += rows.load[i] * stretch[i];
  }
  if (!(sum > law.limit * total)) return 1;
  // The share of the load that slips is concave in the share of the stretch, so Newton's method
  // comes from below.
  double share = kSlipping * law.limit * total / sum;
  for (int step = 0; step < kYieldSteps; ++step) {
    double slips = 0, slope = 0;
    for (std::size_t i = 0; i < rows.count; ++i) {
      const double part = rows.load[i] / total, z = stretch[i] / law.limit;
      slips += part * std::min(1.0, share * z);
      if (share * z < 1) slope += part * z;
    }
    if (!(slope > 0) || !(slips < kSlipping)) break;
    share += (kSlipping - slips) / slope;
  }
  return std::min(1.0, share / kSlipping);
}

template Mat6 friction_stiffness(const FrictionRows<float>&, const FrictionLaw&, const Vec6&,
                                 const Vec6&);
template Mat6 friction_stiffness(const FrictionRows<double>&, const FrictionLaw&, const Vec6&,
                                 const Vec6&);
template Mat6 friction_turning(const FrictionRows<float>&, const FrictionLaw&, const Vec6&,
                               const Vec6&);
template Mat6 friction_turning(const FrictionRows<double>&, const FrictionLaw&, const Vec6&,
                               const Vec6&);
template double friction_yield(const FrictionRows<float>&, const FrictionLaw&, const double*);
template double friction_yield(const FrictionRows<double>&, const FrictionLaw&, const double*);

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
    const FrictionScratch& scratch = lane.scratch->friction;
    const FrictionRows<float> rows = rows_that_rub(shell.contacts, set.contact, pair, u, scratch);
    if (rows.total > 0)
      sum_pair(set, a, b, u, rows, scratch.stretch, spring);
    else
      spring = {};
  }
}

void add_friction(const Settings& set, const Sides& sides, Pair& pair,
                  const FrictionSpring& spring) {
  if (!spring.holds) return;
  const Mat6 S = arm_shift(sides.a, sides.b);
  const Mat6& K = spring.K;
  const double beta = set.contact.damping;
  if (!sides.a.fixed) sides.on_a.f += spring.f, sides.on_a.K -= K, sides.on_a.D -= beta * K;
  if (!sides.b.fixed) {
    const Mat6 SKS = S * (K * S.transpose());
    sides.on_b.f -= S * spring.f, sides.on_b.K -= SKS, sides.on_b.D -= beta * SKS;
  }
  if (pair.between) {
    const Mat6 KS = K * S.transpose(), SK = S * K;
    pair.between->Kab += KS, pair.between->Dab += beta * KS;
    pair.between->Kba += SK, pair.between->Dba += beta * SK;
  }
  if (set.gradient == H6_EXACT) add_turning(sides, S, pair, spring);
  lead(set, sides, S, K);
}

}  // namespace h6
