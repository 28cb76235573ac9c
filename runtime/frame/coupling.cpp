// SPDX-License-Identifier: Apache-2.0
// coupling.cpp - what stands between the hand and its body.
//
// Virtual coupling: McNeely 1999, Wan & McNeely 2003. Saturation: Barbic & James 2008. METHOD.md,
// Sec. 4. Spring and damper saturate together: damping outside the bound would break it.
#include <cmath>

#include "runtime/frame/stages.h"

namespace h6 {
namespace {

// y shortened to at most `most`; P is d(shortened)/dy.
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

// For a quasi-static step, which has no mass: the true derivative is singular along the pull, so
// free motion would have no answer. The secant leads to where the pull ends.
Saturated saturate_secant(const Vec3& y, double most) {
  Saturated cut = saturate(y, most);
  if (cut.cut) cut.P = most / y.norm() * Mat3::Identity();
  return cut;
}

// Where the hand holds the body's own centre of mass. A body that never turns is held by the
// origin of its mesh frame: a wrist that turns does not move it.
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

// The damping of the free body is in its step.
void couple_admittance(h6Session& s, Hand& hand, Body& body) {
  if (hand.guard.holds()) return;  // a device that was lost pushes no more
  const Saturated force = saturate(from(hand.sample.wrench.force), hand.coupling.max_force);
  const Saturated torque = saturate(from(hand.sample.wrench.torque), hand.coupling.max_torque);
  if (force.cut || torque.cut) s.report.status |= H6_COUPLING_SATURATED;
  hand.wrench << force.value, torque.value;
  if (body.translation_only) hand.wrench.tail<3>().setZero();
  body.f += hand.wrench;
}

}  // namespace

Pull pull_of(const h6Session& s, const Hand& hand, const RigidState& target,
             const RigidState& pulled) {
  const Body& body = s.bodies[hand.body];
  const h6CouplingDef& c = hand.coupling;
  const bool at_rest = c.mode == H6_COUPLING_STATIC;
  const auto limit = at_rest ? saturate_secant : saturate;
  const double zeta = at_rest ? 0 : c.damping_ratio;
  const double b = 2 * zeta * std::sqrt(c.stiffness * body.mass);
  const Saturated force =
      limit(c.stiffness * (target.x - pulled.x) + b * (target.v - pulled.v), c.max_force);
  Pull pull;
  clear(pull.K);
  clear(pull.D);
  pull.wrench.head<3>() = force.value;
  pull.K.topLeftCorner<3, 3>() = -(c.stiffness * force.P);
  pull.D.topLeftCorner<3, 3>() = -(b * force.P);
  pull.cut = force.cut;
  if (body.translation_only) return pull;

  const double b_rot = 2 * zeta * std::sqrt(c.rotational_stiffness * body.inertia.trace() / 3);
  const Vec3 theta = log_rotation(target.q * pulled.q.conjugate());
  const Saturated torque =
      limit(c.rotational_stiffness * theta + b_rot * (target.w - pulled.w), c.max_torque);
  pull.wrench.tail<3>() = torque.value;
  pull.D.bottomRightCorner<3, 3>() = -(b_rot * torque.P);
  pull.cut = pull.cut || torque.cut;
  if (s.gradient == H6_EXACT && !(at_rest && torque.cut))
    pull.K.bottomRightCorner<3, 3>() =
        -(c.rotational_stiffness * torque.P * right_jacobian_inverse(theta));
  else
    pull.K.bottomRightCorner<3, 3>() = -(c.rotational_stiffness * torque.P);
  return pull;
}

void hold(h6Session& s, Hand& hand) {
  Body& body = s.bodies[hand.body];
  if (body.motion != Motion::held || !hand.seen) return;
  hand.manipulandum = held_by(hand.sample, body);
  static_cast<RigidState&>(body) = hand.manipulandum;
}

void couple(h6Session& s, Hand& hand) {
  Body& body = s.bodies[hand.body];
  hand.wrench.setZero();
  if (hand.mode == H6_ADMITTANCE) return couple_admittance(s, hand, body);
  if (hand.mode == H6_IMPEDANCE && !hand.seen) return;
  if (body.motion == Motion::held) {
    // The hand carries all that acts on the body.
    hand.wrench = -body.f;
    if (body.translation_only) hand.wrench.tail<3>().setZero();
    return;
  }
  if (hand.mode == H6_IMPEDANCE)
    hand.manipulandum = held_by(hand.sample, body);
  else
    step_manipulandum(s, hand);
  const Pull pull = pull_of(s, hand, hand.manipulandum, body);
  if (pull.cut) s.report.status |= H6_COUPLING_SATURATED;
  hand.wrench = pull.wrench;
  body.f += pull.wrench;
  body.K += pull.K;
  body.D += pull.D;
}

}  // namespace h6
