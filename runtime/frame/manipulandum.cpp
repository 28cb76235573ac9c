// SPDX-License-Identifier: Apache-2.0
// manipulandum.cpp - pseudo-admittance: what the hand holds has mass (Xu & Barbic 2016, Fig. 13).
//
//   device --[driver's coupling]-- manipulandum --[virtual coupling]-- body --[contacts]-- world
//
// The driver says what its coupling does, F_d = k_dd (x_dev - x_m) + b_dd (v_dev - v_m). Of the two
// implicit steps of a frame this is the first; the body's follows, towards where this one ends.
// And, in both admittance modes, what moves does not leave its device behind. METHOD.md, Sec. 4.
#include "runtime/frame/solve.h"
#include "runtime/frame/stages.h"

namespace h6 {
namespace {

// A driver's coupling turns as hard as one that is this far away pulls (METHOD.md, Sec. 4) [m].
constexpr double kDriverLever = 0.03;

// The driver's spring and damper, and how fast its other end moves.
Mat6 diagonal(double translation, double rotation) {
  Mat6 m = Mat6::Zero();
  m.diagonal().head<3>().setConstant(translation);
  m.diagonal().tail<3>().setConstant(rotation);
  return m;
}

Vec6 velocity_of_device(const Hand& hand, const Body& body) {
  const Vec3 w = from(hand.sample.velocity.angular);
  Vec6 u;
  u << from(hand.sample.velocity.linear) + w.cross(hand.manipulandum.R * body.com), w;
  return u;
}

// Shortened to at most `most`.
Vec3 at_most(const Vec3& v, double most) {
  const double n = v.norm();
  return n > most ? Vec3(most / n * v) : v;
}

}  // namespace

void follow_device(Hand& hand, const Body& body, RigidState& state, const h6BodyState& wanted,
                   const h6DeviceCommand& passed, double h) {
  if ((passed.causes & (1u << H6_CAUSE_SPEED | 1u << H6_CAUSE_CLAMPED)) == 0) return;
  const h6Pose pose = mesh_pose(body, state);
  const h6Velocity u = mesh_velocity(body, state);
  const Vec3 ahead = hand.motion_scale * (from(passed.pose.p) - from(wanted.pose.p));
  const Vec3 turned =
      hand.rotation_scale * log_rotation(from(passed.pose.q) * from(wanted.pose.q).conjugate());
  const Vec3 origin = from(pose.p) + at_most(ahead, h * from(u.linear).norm());
  if (!body.translation_only) {
    state.q = (exp_rotation(at_most(turned, h * from(u.angular).norm())) * state.q).normalized();
    state.R = state.q.toRotationMatrix();
    state.w = hand.rotation_scale * from(passed.velocity.angular);
  }
  const Vec3 lever = state.R * body.com;
  state.x = origin + lever;
  state.v = hand.motion_scale * from(passed.velocity.linear) + state.w.cross(lever);
}

void step_manipulandum(h6Session& s, Hand& hand) {
  const Body& body = s.bodies[hand.body];
  RigidState& m = hand.manipulandum;
  if (hand.guard.holds()) {  // a driver that was lost pulls no more
    m.v.setZero();
    m.w.setZero();
    return;
  }
  const double h = s.dt, lever2 = kDriverLever * kDriverLever;
  const Mat6 K = diagonal(-hand.driver_stiffness, -hand.driver_stiffness * lever2);
  const Mat6 D = diagonal(-hand.driver_damping, -hand.driver_damping * lever2);
  const Pull pull = pull_of(s, hand, body, m);  // the body's, on the manipulandum
  Vec6 driver;
  driver << from(hand.sample.wrench.force), from(hand.sample.wrench.torque);

  const Vec6 f = driver + pull.wrench - gyroscopic(body, m, hand.manipulandum_mass);
  // Device and body move on meanwhile: without that, every free motion would feel a drag of h k.
  const Vec6 drift =
      pull.K * (velocity(m) - velocity(body)) + K * (velocity(m) - velocity_of_device(hand, body));
  Mat6 A = mass_matrix(body, m, hand.manipulandum_mass) - h * (pull.D + D) - h * h * (pull.K + K);
  Vec6 rhs = h * (f + h * drift), du;
  if (body.translation_only) hold_rotation(A, rhs, 0);
  if (!solve_system(s.gradient, A, rhs, du)) {
    s.report.status |= H6_SOLVE_FAILED;
    du.setZero();
  }
  if (!move_or_rest(m, du, h, body.translation_only)) s.report.status |= H6_STATE_NOT_FINITE;
}

}  // namespace h6
