// SPDX-License-Identifier: Apache-2.0
// rigid_step.cpp - one time step of the moving bodies.
//
// Implicit (METHOD.md, Sec. 2; Barbic & James 2008):
//     (M - h D - h^2 K) du = h (f + h K u - [0; w x I w]),   x += h v,   R = exp(h w) R
// Bodies that may touch one another are one dense system when there are at most four of them.
#include "runtime/frame/solve.h"
#include "runtime/frame/stages.h"

namespace h6 {
namespace {

constexpr double kGripLever = 0.05;  // of a hand that twists (METHOD.md, Sec. 4) [m]

bool sane(const RigidState& state) {
  return state.x.allFinite() && state.v.allFinite() && state.w.allFinite() &&
         state.q.coeffs().allFinite();
}

// Admittance: damping of the free body, with a lever of its own for the twist of a small part.
Mat6 drag_matrix(const Body& body) {
  Mat6 B = body.drag / body.mass * mass_matrix(body, body, body.mass);
  B.bottomRightCorner<3, 3>().diagonal().array() += body.drag * kGripLever * kGripLever;
  return B;
}

// Wrench less the gyroscopic torque.
Vec6 driving(const Body& body) { return body.f - gyroscopic(body, body, body.mass); }

void advance(h6Session& s, Body& body, const Vec6& du) {
  if (!move_or_rest(body, du, s.dt, body.translation_only)) s.report.status |= H6_STATE_NOT_FINITE;
}

Vec6 explicit_change(const h6Session& s, const Body& body) {
  const Vec6 f = s.dt * driving(body);
  Vec6 du = Vec6::Zero();
  du.head<3>() = f.head<3>() / body.mass;
  if (!body.translation_only)
    du.tail<3>() = body.R * body.inertia.inverse() * (body.R.transpose() * f.tail<3>());
  if (!(body.drag > 0)) return du;
  // The damping stays implicit.
  Mat6 M = mass_matrix(body, body, body.mass);
  const Mat6 B = drag_matrix(body);
  Vec6 rhs = M * du - s.dt * (B * velocity(body));
  M += s.dt * B;
  if (body.translation_only) hold_rotation(M, rhs, 0);
  Vec6 damped;
  return solve_system(H6_SYMMETRIC, M, rhs, damped) ? damped : du;
}

int place_in(const Island& island, std::int32_t body) {
  for (int i = 0; i < island.count; ++i)
    if (island.body[i] == body) return i;
  return -1;
}

// `series`: field bodies that one shell body touches feel one another.
void add_between_fields(const h6Session& s, const Island& island, IslandMatrix& K,
                        IslandMatrix& D) {
  for (std::size_t first = 0, end; first < s.pair_count; first = end) {
    end = pairs_of_shell(s, first);
    if (place_in(island, s.pairs[first].a) < 0) continue;
    for (std::size_t p = first; p < end; ++p)
      for (std::size_t q = first; q < end; ++q) {
        const int b = place_in(island, s.pairs[p].b), other = place_in(island, s.pairs[q].b);
        if (p == q || b < 0 || other < 0) continue;
        K.block<6, 6>(6 * b, 6 * other) += s.pairs[p].left * s.pairs[q].right;
        D.block<6, 6>(6 * b, 6 * other) += s.contact.damping * s.pairs[p].left * s.pairs[q].right_d;
      }
  }
}

// What a body brings along, whatever it touches: its drag damps it and pushes.
struct OwnTerms {
  Mat6 M, D;
  Vec6 u, f;
};
OwnTerms own_terms(const Body& body) {
  OwnTerms own;
  own.M = mass_matrix(body, body, body.mass);
  own.D = body.D;
  own.u = velocity(body);
  own.f = driving(body);
  if (body.drag > 0) {
    const Mat6 B = drag_matrix(body);
    own.D -= B;
    own.f -= B * own.u;
  }
  return own;
}

// A body that is coupled to no other, whatever it touches.
bool solve_one(const h6Session& s, const Body& body, Vec6& du) {
  const double h = s.dt;
  const OwnTerms own = own_terms(body);
  Mat6 A = own.M - h * own.D - h * h * body.K;
  Vec6 rhs = h * (own.f + h * (body.K * own.u));
  if (body.translation_only) hold_rotation(A, rhs, 0);
  return solve_system(s.gradient, A, rhs, du);
}

bool solve_together(const h6Session& s, const Island& island, IslandVector& du) {
  const double h = s.dt;
  const int n = 6 * island.count;
  IslandMatrix K = IslandMatrix::Zero(n, n), D = K, A = K;
  IslandVector u(n), f(n);
  for (int i = 0; i < island.count; ++i) {
    const Body& body = s.bodies[island.body[i]];
    const OwnTerms own = own_terms(body);
    A.block<6, 6>(6 * i, 6 * i) = own.M;
    K.block<6, 6>(6 * i, 6 * i) = body.K;
    D.block<6, 6>(6 * i, 6 * i) = own.D;
    u.segment<6>(6 * i) = own.u;
    f.segment<6>(6 * i) = own.f;
  }
  for (std::size_t p = 0; p < s.pair_count; ++p) {
    const int a = place_in(island, s.pairs[p].a), b = place_in(island, s.pairs[p].b);
    if (a < 0 || b < 0) continue;
    K.block<6, 6>(6 * a, 6 * b) += s.pairs[p].Kab;
    K.block<6, 6>(6 * b, 6 * a) += s.pairs[p].Kba;
    D.block<6, 6>(6 * a, 6 * b) += s.pairs[p].Dab;
    D.block<6, 6>(6 * b, 6 * a) += s.pairs[p].Dba;
  }
  if (s.contact.method == H6_METHOD_SERIES) add_between_fields(s, island, K, D);
  A -= h * D + h * h * K;
  f += h * K.lazyProduct(u);
  f *= h;
  for (int i = 0; i < island.count; ++i)
    if (s.bodies[island.body[i]].translation_only) hold_rotation(A, f, i);
  return solve_system(s.gradient, A, f, du);
}

void step_island(h6Session& s, const Island& island) {
  IslandVector du;
  Vec6 alone;
  const bool one = island.count == 1;
  if (s.integrator == H6_IMPLICIT &&
      (one ? solve_one(s, s.bodies[island.body[0]], alone) : solve_together(s, island, du))) {
    for (int i = 0; i < island.count; ++i)
      advance(s, s.bodies[island.body[i]], one ? alone : Vec6(du.segment<6>(6 * i)));
    return;
  }
  if (s.integrator == H6_IMPLICIT) s.report.status |= H6_SOLVE_FAILED;
  for (int i = 0; i < island.count; ++i) {
    Body& body = s.bodies[island.body[i]];
    advance(s, body, explicit_change(s, body));
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

bool move_or_rest(RigidState& state, const Vec6& du, double h, bool translation_only) {
  const RigidState before = state;
  state.v += du.head<3>();
  state.x += h * state.v;
  if (!translation_only) {
    state.w += du.tail<3>();
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

void step_bodies(h6Session& s) {
  for (std::size_t h = 0; h < s.hand_count; ++h) {
    Body& body = s.bodies[s.hands[h].body];
    if (body.motion == Motion::quasi_static && s.hands[h].seen) step_static(s, body);
  }
  for (std::size_t i = 0; i < s.island_count; ++i) step_island(s, s.islands[i]);
}

}  // namespace h6
