// SPDX-License-Identifier: Apache-2.0
// coupling.cpp - the coupling between a hand and its body.
//
// Virtual coupling: McNeely 1999, Wan & McNeely 2003. Saturation: Barbic & James 2008. METHOD.md,
// Sec. 4. The spring saturates first, then its sum with the damper: so the pull is damped along
// itself, and the bound holds for both.
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

struct Spring {
  double k, b, most;
};
struct Link {
  Vec3 f;
  Mat3 K, D;  // derivatives of f by the pulled body's place and velocity
  bool cut;
};
// A spring that holds at most `most`, and a damper that is critical for what is left of the spring.
// Their sum is saturated again.
//
// A quasi-static body takes the secant: the true derivative is singular along the pull, so free
// motion would have no solution, while the secant leads to the pose at which the pull ends. It has
// no mass, and its lag behind the hand is damper over spring.
Link link(const Spring& spring, const Vec3& stretch, const Vec3& rate, bool secant, bool exact) {
  const Vec3 pull = spring.k * stretch;
  const Saturated held = saturate(pull, spring.most);
  const double left = held.cut ? spring.most / pull.norm() : 1.0;
  const double b = spring.b * (secant ? left : std::sqrt(left));
  const Saturated sum = saturate(held.value + b * rate, spring.most);
  const double kept = sum.cut ? spring.most / (held.value + b * rate).norm() : 1.0;
  Link out{sum.value, Mat3::Zero(), -(b * sum.P), held.cut || sum.cut};
  if (secant) {
    out.K = -(spring.k * left * kept) * Mat3::Identity();
    out.D = -(b * kept) * Mat3::Identity();
  } else if (!exact)
    out.K = -(spring.k * kept) * held.P;
  else
    out.K = -spring.k * sum.P *
            (held.cut ? Mat3(held.P - (0.5 * b / pull.squaredNorm()) * rate * pull.transpose())
                      : held.P);
  return out;
}

// Where a hand at this pose holds the body's centre of mass. A body that never turns is held at the
// origin of its mesh frame, so that a turning wrist does not move it.
RigidState held_by(const Hand& hand, const h6Pose& pose, const Body& body) {
  const h6Velocity& velocity = hand.sample.velocity;
  RigidState m;
  m.q = body.translation_only ? body.q : from(pose.q);
  m.R = body.translation_only ? body.R : m.q.toRotationMatrix();
  if (!body.translation_only) m.w = from(velocity.angular);
  const Vec3 lever = m.q * body.com;
  m.x = from(pose.p) + lever;
  m.v = from(velocity.linear) + m.w.cross(lever);
  return m;
}

h6Pose between(const h6Pose& a, const h6Pose& b, double share) {
  if (share >= 1) return b;
  const Quat q = from(a.q);
  const Vec3 turn = log_rotation(from(b.q) * q.conjugate());
  return {to(Vec3(from(a.p) + share * (from(b.p) - from(a.p)))),
          to((exp_rotation(share * turn) * q).normalized())};
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
  const auto damper = [&](double k, double inertia) {
    return at_rest ? body.lag * k : coupling_damper(c, k, inertia);
  };
  const Spring forward{c.stiffness, damper(c.stiffness, body.mass), c.max_force};
  const Link force =
      link(forward, target.x - pulled.x, target.v - pulled.v, at_rest, gradient == H6_EXACT);
  Pull pull;
  pull.wrench.set_zero();
  auto& [f, K, D] = pull.wrench;
  f.head<3>() = force.f;
  K.topLeftCorner<3, 3>() = force.K;
  D.topLeftCorner<3, 3>() = force.D;
  pull.cut = force.cut;
  if (body.translation_only) return pull;

  const double k = c.rotational_stiffness;
  const Spring turning{k, damper(k, mean_inertia(body)), c.max_torque};
  const Vec3 theta = log_rotation(target.q * pulled.q.conjugate());
  const Link torque = link(turning, theta, target.w - pulled.w, at_rest, gradient == H6_EXACT);
  f.tail<3>() = torque.f;
  D.bottomRightCorner<3, 3>() = torque.D;
  pull.cut = pull.cut || torque.cut;
  K.bottomRightCorner<3, 3>() = torque.K;
  if (gradient == H6_EXACT && !(at_rest && torque.cut))
    K.bottomRightCorner<3, 3>() *= right_jacobian_inverse(theta);
  return pull;
}

Way way_of(const Hand& hand, const Body& body) {
  const RigidState from = held_by(hand, hand.start, body),
                   goal = held_by(hand, hand.sample.pose, body);
  return {(goal.x - from.x).norm(), log_rotation(goal.q * from.q.conjugate()).norm()};
}

void hold(Hand& hand, Body& body, double share) {
  if (!hand.seen) return;
  hand.now = between(hand.start, hand.sample.pose, share);
  if (body.motion != Motion::held) return;
  hand.manipulandum = held_by(hand, hand.now, body);
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
    hand.manipulandum = held_by(hand, hand.now, body);
  else
    step_manipulandum(set, hand, body, status);
  const bool steps = body.motion == Motion::quasi_static;
  RigidState pulled = body;
  if (steps) pulled.v = body.step_rate.head<3>(), pulled.w = body.step_rate.tail<3>();
  const Pull pull = pull_of(set.gradient, hand.coupling, body, hand.manipulandum, pulled);
  if (pull.cut) status |= H6_COUPLING_SATURATED;
  const auto& [f, K, D] = pull.wrench;
  hand.wrench = f;
  acting.f += f;
  acting.K += K;
  if (steps) {  // the damper resists the step dq, whose velocity is dq/h
    acting.f -= D * body.step_rate;
    acting.K += D / set.dt;
  } else {
    acting.D += D;
  }
}

}  // namespace h6
