// coupling.cpp - the spring and damper between what the hand holds and the simulated body.
//
// Virtual coupling: McNeely 1999, Wan & McNeely 2003. Saturation: Barbic & James 2008. METHOD.md,
// Sec. 4. Spring and damper saturate together: damping outside the bound would break it.
#include <cmath>

#include "runtime/stages.h"

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

}  // namespace

void couple(h6Session& s, Hand& hand) {
  Body& body = s.bodies[hand.body];
  hand.wrench.setZero();
  if (!hand.seen) return;
  const h6CouplingDef& c = hand.coupling;

  // The manipulandum is the body's own centre of mass, where the hand holds it.
  const Quat qm = from(hand.sample.pose.q);
  const Vec3 lever = qm * body.com;
  const Vec3 wm = from(hand.sample.velocity.angular);
  const Vec3 xm = from(hand.sample.pose.p) + lever;
  const Vec3 vm = from(hand.sample.velocity.linear) + wm.cross(lever);

  const double b = 2 * c.damping_ratio * std::sqrt(c.stiffness * body.mass);
  const double b_rot =
      2 * c.damping_ratio * std::sqrt(c.rotational_stiffness * body.inertia.trace() / 3);
  const Vec3 theta = log_rotation(qm * body.q.conjugate());
  const Saturated force = saturate(c.stiffness * (xm - body.x) + b * (vm - body.v), c.max_force);
  const Saturated torque =
      saturate(c.rotational_stiffness * theta + b_rot * (wm - body.w), c.max_torque);
  if (force.cut || torque.cut) s.report.status |= H6_COUPLING_SATURATED;

  hand.wrench << force.value, torque.value;
  body.f += hand.wrench;
  body.K.topLeftCorner<3, 3>() -= c.stiffness * force.P;
  body.D.topLeftCorner<3, 3>() -= b * force.P;
  body.D.bottomRightCorner<3, 3>() -= b_rot * torque.P;
  if (s.gradient == H6_EXACT)
    body.K.bottomRightCorner<3, 3>() -=
        c.rotational_stiffness * torque.P * right_jacobian_inverse(theta);
  else
    body.K.bottomRightCorner<3, 3>() -= c.rotational_stiffness * torque.P;
}

}  // namespace h6
