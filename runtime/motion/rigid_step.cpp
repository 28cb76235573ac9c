// SPDX-License-Identifier: Apache-2.0
// rigid_step.cpp - one time step of the moving bodies.
//
// Implicit (METHOD.md, Sec. 2; Barbic & James 2008):
//     (M - h D - h^2 K) du = h (f + h K u - [0; w x I w]),   x += h v,   R = exp(h w) R
// Bodies that may touch one another are one dense system when there are at most four of them.
#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

constexpr double kGripLever = 0.05;  // lever of a hand that twists a part; METHOD.md, Sec. 4 [m]

bool sane(const RigidState& state) {
  return state.x.allFinite() && state.v.allFinite() && state.w.allFinite() &&
         state.q.coeffs().allFinite();
}

// Admittance: the damping of the free body. The grip's lever also damps the twist of a small part.
Mat6 drag_matrix(const Body& body) {
  Mat6 B = body.drag / body.mass * mass_matrix(body, body, body.mass);
  B.bottomRightCorner<3, 3>().diagonal().array() += body.drag * kGripLever * kGripLever;
  return B;
}

// The wrench less the gyroscopic torque.
Vec6 driving(const Body& body, const LinearWrench& acting) {
  return acting.f - gyroscopic(body, body, body.mass);
}

// The change of velocity in one explicit step. The drag is still implicit.
Vec6 explicit_change(const Body& body, const LinearWrench& acting, double dt) {
  const Vec6 f = dt * driving(body, acting);
  Vec6 du = Vec6::Zero();
  du.head<3>() = f.head<3>() / body.mass;
  if (!body.translation_only)
    du.tail<3>() = body.R * body.inertia.inverse() * (body.R.transpose() * f.tail<3>());
  if (!(body.drag > 0)) return du;
  Mat6 M = mass_matrix(body, body, body.mass);
  const Mat6 B = drag_matrix(body);
  Vec6 rhs = M * du - dt * (B * velocity(body));
  M += dt * B;
  if (body.translation_only) hold_rotation(M, rhs, 0);
  Vec6 damped;
  return solve_system(H6_SYMMETRIC, M, rhs, damped) ? damped : du;
}

int place_in(const Island& island, std::int32_t body) {
  for (int i = 0; i < island.count; ++i)
    if (island.body[i] == body) return i;
  return -1;
}

// `series` couples the field bodies that one shell body touches.
void add_between_fields(std::span<const ShellBody> shells, const Island& island, double beta,
                        IslandMatrix& K, IslandMatrix& D) {
  for (const ShellBody& shell : shells) {
    if (place_in(island, shell.body) < 0) continue;
    for (const Pair& p : shell.pairs)
      for (const Pair& q : shell.pairs) {
        const int b = place_in(island, p.b), other = place_in(island, q.b);
        if (&p == &q || b < 0 || other < 0) continue;
        K.block<6, 6>(6 * b, 6 * other) += p.of_fields->left * q.of_fields->right;
        D.block<6, 6>(6 * b, 6 * other) += beta * p.of_fields->left * q.of_fields->right_d;
      }
  }
}

// The terms of one body in the system of its island; the drag adds to damping and wrench.
struct OwnTerms {
  Mat6 M, D;
  Vec6 u, f;
};
OwnTerms own_terms(const Body& body, const LinearWrench& acting) {
  OwnTerms own;
  own.M = mass_matrix(body, body, body.mass);
  own.D = acting.D;
  own.u = velocity(body);
  own.f = driving(body, acting);
  if (body.drag > 0) {
    const Mat6 B = drag_matrix(body);
    own.D -= B;
    own.f -= B * own.u;
  }
  return own;
}

// Solves for a body that is coupled to no other moving body.
bool solve_one(const Settings& set, const Body& body, const LinearWrench& acting, Vec6& du) {
  const double h = set.dt;
  const OwnTerms own = own_terms(body, acting);
  Mat6 A = own.M - h * own.D - h * h * acting.K;
  Vec6 rhs = h * (own.f + h * (acting.K * own.u));
  if (body.translation_only) hold_rotation(A, rhs, 0);
  return solve_system(set.gradient, A, rhs, du);
}

bool solve_together(const Settings& set, std::span<const Body> bodies,
                    std::span<const LinearWrench> acting, std::span<const ShellBody> shells,
                    const Island& island, IslandVector& du) {
  const double h = set.dt;
  const int n = 6 * island.count;
  IslandMatrix K = IslandMatrix::Zero(n, n), D = K, A = K;
  IslandVector u(n), f(n);
  for (int i = 0; i < island.count; ++i) {
    const LinearWrench& on = acting[island.body[i]];
    const OwnTerms own = own_terms(bodies[island.body[i]], on);
    A.block<6, 6>(6 * i, 6 * i) = own.M;
    K.block<6, 6>(6 * i, 6 * i) = on.K;
    D.block<6, 6>(6 * i, 6 * i) = own.D;
    u.segment<6>(6 * i) = own.u;
    f.segment<6>(6 * i) = own.f;
  }
  for (const ShellBody& shell : shells)
    for (const Pair& pair : shell.pairs) {
      const int a = place_in(island, pair.a), b = place_in(island, pair.b);
      if (a < 0 || b < 0) continue;
      K.block<6, 6>(6 * a, 6 * b) += pair.between->Kab;
      K.block<6, 6>(6 * b, 6 * a) += pair.between->Kba;
      D.block<6, 6>(6 * a, 6 * b) += pair.between->Dab;
      D.block<6, 6>(6 * b, 6 * a) += pair.between->Dba;
    }
  if (uses_series(set.contact)) add_between_fields(shells, island, set.contact.damping, K, D);
  A -= h * D + h * h * K;
  f += h * K.lazyProduct(u);
  f *= h;
  for (int i = 0; i < island.count; ++i)
    if (bodies[island.body[i]].translation_only) hold_rotation(A, f, i);
  return solve_system(set.gradient, A, f, du);
}

void accelerate_island(const Settings& set, std::span<Body> bodies,
                       std::span<const LinearWrench> acting, std::span<const ShellBody> shells,
                       const Island& island, h6Status& status) {
  IslandVector du;
  Vec6 alone;
  const bool one = island.count == 1, implicit = set.integrator == H6_IMPLICIT;
  const std::int32_t first = island.body[0];
  const bool solved = implicit && (one ? solve_one(set, bodies[first], acting[first], alone)
                                       : solve_together(set, bodies, acting, shells, island, du));
  if (implicit && !solved) status |= H6_SOLVE_FAILED;
  for (int i = 0; i < island.count; ++i) {
    const std::int32_t b = island.body[i];
    Body& body = bodies[b];
    const Vec6 change = !solved ? explicit_change(body, acting[b], set.dt)
                        : one   ? alone
                                : Vec6(du.segment<6>(6 * i));
    add_velocity(body, change, body.translation_only);
    body.gained_v += change.head<3>();
    body.gained_w += change.tail<3>();
  }
}

}  // namespace

Mat6 mass_matrix(const Body& body, const RigidState& state, double mass) {
  Mat6 m;
  clear(m);
  m.topLeftCorner<3, 3>() = mass * Mat3::Identity();
  m.bottomRightCorner<3, 3>() = state.R * (mass / body.mass * body.inertia) * state.R.transpose();
  return m;
}

Vec6 velocity(const RigidState& state) {
  Vec6 u;
  u << state.v, state.w;
  return u;
}

Vec6 gyroscopic(const Body& body, const RigidState& state, double mass) {
  const Vec3 momentum =
      state.R * ((mass / body.mass * body.inertia) * (state.R.transpose() * state.w));
  Vec6 g = Vec6::Zero();
  g.tail<3>() = state.w.cross(momentum);
  return g;
}

void add_velocity(RigidState& state, const Vec6& du, bool translation_only) {
  state.v += du.head<3>();
  if (!translation_only) state.w += du.tail<3>();
}

bool move_or_rest(RigidState& state, double h, bool translation_only) {
  const RigidState before = state;
  state.x += h * state.v;
  if (!translation_only) {
    state.q = (exp_rotation(h * state.w) * state.q).normalized();
    state.R = state.q.toRotationMatrix();
  }
  if (sane(state)) return true;
  state = before;
  state.v.setZero();
  state.w.setZero();
  if (!sane(state)) state = RigidState();
  return false;
}

void accelerate_bodies(const Settings& set, std::span<Body> bodies,
                       std::span<const LinearWrench> acting, std::span<const ShellBody> shells,
                       std::span<const Island> islands, h6Status& status) {
  for (const Island& island : islands)
    accelerate_island(set, bodies, acting, shells, island, status);
}

void move_bodies(const Settings& set, std::span<Body> bodies, std::span<const Island> islands,
                 h6Status& status) {
  for (const Island& island : islands)
    for (int i = 0; i < island.count; ++i) {
      Body& body = bodies[island.body[i]];
      if (!move_or_rest(body, set.dt, body.translation_only)) status |= H6_STATE_NOT_FINITE;
    }
}

}  // namespace h6
