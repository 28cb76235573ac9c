// SPDX-License-Identifier: Apache-2.0
// static_step.cpp - a quasi-static body moves straight to the pose in which its wrenches balance.
//
// Wan & McNeely 2003: dq = -(K_c + K_VC)^-1 (f_c + f_VC), one solve a frame. METHOD.md, Sec. 4.
#include "runtime/motion/motion_stages.h"
#include "runtime/motion/solve.h"

namespace h6 {
namespace {

// An upper bound on the motion of the body's points.
double reach(const Body& body, const Vec6& dq) {
  return dq.head<3>().norm() + dq.tail<3>().norm() * body.radius;
}

}  // namespace

void step_static(const Settings& set, Body& body, const LinearWrench& acting, double most,
                 h6Status& status) {
  Mat6 A = -acting.K;
  Vec6 f = acting.f, dq;
  body.step_rate.setZero();
  if (body.translation_only) hold_rotation(A, f, 0);
  if (!solve_system(set.gradient, A, f, dq)) {
    status |= H6_SOLVE_FAILED;
    return;
  }
  const double far = reach(body, dq);
  if (far > most) dq *= most / far;
  // dq acts as a velocity for one second; the body has no velocity before or after.
  body.v.setZero();
  body.w.setZero();
  add_velocity(body, dq, body.translation_only);
  if (move_or_rest(body, 1, body.translation_only))
    body.step_rate = dq / set.dt;
  else
    status |= H6_STATE_NOT_FINITE;
  body.v.setZero();
  body.w.setZero();
}

}  // namespace h6
