// SPDX-License-Identifier: Apache-2.0
// coupling.cpp - the coupling between a hand and its body.
//
// Virtual coupling: McNeely 1999, Wan & McNeely 2003. Saturation: Barbic & James 2008. METHOD.md,
// Sec. 4. Spring and damper saturate together: damping outside the bound would break it.
#include <cmath>

#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

// y shortened to at most `most`; P is the derivative of the shortened y by y.
struct Saturated {
  Vec3 value;
  Mat3 P;
  bool cut;
};
Saturated saturate(const Vec3& y, double most) {
  const double n = y.norm();
  if (n <= most) return {y, Mat3::Identity(), false};
  const Vec3 d = y / n;
  return {most * d, most / n * (Mat3::Identity() - d * d.transpose()), true};
}

// For a quasi-static step, which has no mass. The true derivative is singular along the pull, so
// free motion would have no solution. The secant leads to the pose at which the pull ends.
Saturated saturate_secant(const Vec3& y, double most) {
  Saturated cut = saturate(y, most);
  if (cut.cut) cut.P = most / y.norm() * Mat3::Identity();
  return cut;
}

// Where the hand holds the body's centre of mass. A body that never turns is held at the origin of
// its mesh frame, so that a turning wrist does not move it.
RigidState held_by(const h6DeviceSample& sample, const Body& body) {
  RigidState m;
  m.q = body.translation_only ? body.q : from(sample.pose.q);
  m.R = body.translation_only ? body.R : m.q.toRotationMatrix();
  if (!body.translation_only) m.w = from(sample.velocity.angular);
  const Vec3 lever = m.q * body.com;
  m.x = from(sample.pose.p) + lever;
  m.v = from(sample.velocity.linear) + m.w.cross(lever);
  return m;
}

// Adds the device's wrench. The damping of the free body is part of its step.
void couple_admittance(Hand& hand, const Body& body, LinearWrench& acting, h6Status& status) {
  if (hand.cut_off) return;  // a lost device no longer pushes
  const Saturated force = saturate(from(hand.sample.wrench.force), hand.coupling.max_force);
  const Saturated torque = saturate(from(hand.sample.wrench.torque), hand.coupling.max_torque);
  if (force.cut || torque.cut) status |= H6_COUPLING_SATURATED;
  hand.wrench << force.value, torque.value;
  if (body.translation_only) hand.wrench.tail<3>().setZero();
  acting.f += hand.wrench;
}

}  // namespace

Pull pull_of(h6Gradient gradient, const h6CouplingDef& c, const Body& body,
             const RigidState& target, const RigidState& pulled) {
  const bool at_rest = c.mode == H6_COUPLING_STATIC;
  const auto limit = at_rest ? saturate_secant : saturate;
  const double zeta = at_rest ? 0 : c.damping_ratio;
  const double b = 2 * zeta * std::sqrt(c.stiffness * body.mass);
  const Saturated force =
      limit(c.stiffness * (target.x - pulled.x) + b * (target.v - pulled.v), c.max_force);
  Pull pull;
  pull.wrench.set_zero();
  auto& [f, K, D] = pull.wrench;
  f.head<3>() = force.value;
  K.topLeftCorner<3, 3>() = -(c.stiffness * force.P);
  D.topLeftCorner<3, 3>() = -(b * force.P);
  pull.cut = force.cut;
  if (body.translation_only) return pull;

  const double b_rot = 2 * zeta * std::sqrt(c.rotational_stiffness * body.inertia.trace() / 3);
  const Vec3 theta = log_rotation(target.q * pulled.q.conjugate());
  const Saturated torque =
      limit(c.rotational_stiffness * theta + b_rot * (target.w - pulled.w), c.max_torque);
  f.tail<3>() = torque.value;
  D.bottomRightCorner<3, 3>() = -(b_rot * torque.P);
  pull.cut = pull.cut || torque.cut;
  if (gradient == H6_EXACT && !(at_rest && torque.cut))
    K.bottomRightCorner<3, 3>() =
        -(c.rotational_stiffness * torque.P * right_jacobian_inverse(theta));
  else
    K.bottomRightCorner<3, 3>() = -(c.rotational_stiffness * torque.P);
  return pull;
}

void hold(Hand& hand, Body& body) {
  if (body.motion != Motion::held || !hand.seen) return;
  hand.manipulandum = held_by(hand.sample, body);
  static_cast<RigidState&>(body) = hand.manipulandum;
}

void couple(const Settings& set, Hand& hand, const Body& body, LinearWrench& acting,
            h6Status& status) {
  hand.wrench.setZero();
  if (hand.mode == H6_ADMITTANCE) return couple_admittance(hand, body, acting, status);
  if (hand.mode == H6_IMPEDANCE && !hand.seen) return;
  if (body.motion == Motion::held) {
    // The hand carries the whole wrench on the body.
    hand.wrench = -acting.f;
    if (body.translation_only) hand.wrench.tail<3>().setZero();
    return;
  }
  if (hand.mode == H6_IMPEDANCE)
    hand.manipulandum = held_by(hand.sample, body);
  else
    step_manipulandum(set, hand, body, status);
  const Pull pull = pull_of(set.gradient, hand.coupling, body, hand.manipulandum, body);
  if (pull.cut) status |= H6_COUPLING_SATURATED;
  hand.wrench = pull.wrench.f;
  acting.f += pull.wrench.f;
  acting.K += pull.wrench.K;
  acting.D += pull.wrench.D;
}

}  // namespace h6
