// SPDX-License-Identifier: Apache-2.0
// manipulandum.cpp - pseudo-admittance: the manipulandum has mass (Xu & Barbic 2016, Fig. 13).
//
//   device --[driver's coupling]-- manipulandum --[virtual coupling]-- body --[contacts]-- world
//
// The driver reports the wrench of its coupling, F_d = k_dd (x_dev - x_m) + b_dd (v_dev - v_m). A
// frame takes two implicit steps: the manipulandum's, then the body's towards the manipulandum's
// new pose. This file also keeps the state in the scene from running away from its device, in both
// admittance modes. METHOD.md, Sec. 4.
#include "runtime/motion/motion_stages.h"
#include "runtime/motion/solve.h"

namespace h6 {
namespace {

// The lever that turns the driver's stiffness into a rotational one (METHOD.md, Sec. 4) [m].
constexpr double kDriverLever = 0.03;

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

Vec3 at_most(const Vec3& v, double most) {
  const double n = v.norm();
  return n > most ? Vec3(most / n * v) : v;
}

}  // namespace

void follow_device(const HandDevice& device, const Body& body, RigidState& state,
                   const h6BodyState& wanted, const h6DeviceCommand& passed, double h) {
  if ((passed.causes & (1u << H6_CAUSE_SPEED | 1u << H6_CAUSE_CLAMPED)) == 0) return;
  const h6Pose pose = mesh_pose(body, state);
  const h6Velocity u = mesh_velocity(body, state);
  const Vec3 ahead = device.motion_scale * (from(passed.pose.p) - from(wanted.pose.p));
  const Vec3 turned =
      device.rotation_scale * log_rotation(from(passed.pose.q) * from(wanted.pose.q).conjugate());
  const Vec3 origin = from(pose.p) + at_most(ahead, h * from(u.linear).norm());
  if (!body.translation_only) {
    state.q = (exp_rotation(at_most(turned, h * from(u.angular).norm())) * state.q).normalized();
    state.R = state.q.toRotationMatrix();
    state.w = device.rotation_scale * from(passed.velocity.angular);
  }
  const Vec3 lever = state.R * body.com;
  state.x = origin + lever;
  state.v = device.motion_scale * from(passed.velocity.linear) + state.w.cross(lever);
}

void step_manipulandum(const Settings& set, Hand& hand, const Body& body, h6Status& status) {
  RigidState& m = hand.manipulandum;
  if (hand.cut_off) {  // a lost driver no longer pulls
    m.v.setZero();
    m.w.setZero();
    return;
  }
  const double h = set.dt, lever2 = kDriverLever * kDriverLever;
  const Mat6 K = diagonal(-hand.driver_stiffness, -hand.driver_stiffness * lever2);
  const Mat6 D = diagonal(-hand.driver_damping, -hand.driver_damping * lever2);
  const LinearWrench pull = pull_of(set.gradient, hand.coupling, body, body, m).wrench;
  Vec6 driver;
  driver << from(hand.sample.wrench.force), from(hand.sample.wrench.torque);

  const Vec6 f = driver + pull.f - gyroscopic(body, m, hand.manipulandum_mass);
  // Device and body move during the step. Without these terms free motion would feel a drag of h k.
  const Vec6 drift =
      pull.K * (velocity(m) - velocity(body)) + K * (velocity(m) - velocity_of_device(hand, body));
  Mat6 A = mass_matrix(body, m, hand.manipulandum_mass) - h * (pull.D + D) - h * h * (pull.K + K);
  Vec6 rhs = h * (f + h * drift), du;
  if (body.translation_only) hold_rotation(A, rhs, 0);
  if (!solve_system(set.gradient, A, rhs, du)) {
    status |= H6_SOLVE_FAILED;
    du.setZero();
  }
  add_velocity(m, du, body.translation_only);
  if (!move_or_rest(m, h, body.translation_only)) status |= H6_STATE_NOT_FINITE;
}

}  // namespace h6
