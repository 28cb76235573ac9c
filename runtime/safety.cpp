#include "runtime/safety.h"

#include <algorithm>

namespace h6 {
namespace {

// v shortened to at most `most`; true when it was longer.
bool clamp_norm(Vec3& v, double most) {
  // stableNorm: a finite vector whose square overflows must still come out at `most`.
  const double n = v.stableNorm();
  if (n <= most) return false;
  v *= most / n;
  // The product rounds: the limit is kept to the last bit.
  while (v.norm() > most) v *= 1 - 1e-15;
  return true;
}

bool slew(Vec3& v, const Vec3& last, double most) {
  Vec3 step = v - last;
  if (!clamp_norm(step, most)) return false;
  v = last + step;
  return true;
}

// An axis limits when its numbers do: min < max.
bool clamp_to_box(Vec3& x, Vec3& v, const Vec3& least, const Vec3& most) {
  bool cut = false;
  for (int i = 0; i < 3; ++i) {
    if (!(least[i] < most[i]) || (x[i] >= least[i] && x[i] <= most[i])) continue;
    // A device that follows the velocity must not be sent on through the wall.
    v[i] = x[i] < least[i] ? std::max(v[i], 0.0) : std::min(v[i], 0.0);
    x[i] = std::clamp(x[i], least[i], most[i]);
    cut = true;
  }
  return cut;
}

bool sane(const h6Pose& pose) {
  const double n = from(pose.q).norm();
  return finite(pose) && n > 0.5 && n < 2;
}

}  // namespace

SafetyLimits limits_of(const h6DeviceCapabilities& c) {
  const SafetyLimits ceiling;
  SafetyLimits limits;
  // A rating that is not a number or negative is no rating: nothing is rendered.
  const auto rating = [](double value, double most) {
    return value > 0 ? std::min(value, most) : 0.0;
  };
  limits.force = rating(c.max_force, ceiling.force);
  limits.torque = rating(c.max_torque, ceiling.torque);
  limits.force_rate =
      rating(c.max_force_rate > 0 ? c.max_force_rate : limits.force / 0.005, ceiling.force_rate);
  limits.torque_rate = rating(c.max_torque_rate > 0 ? c.max_torque_rate : limits.torque / 0.005,
                              ceiling.torque_rate);
  limits.speed = c.max_velocity > 0 ? std::min(c.max_velocity, ceiling.speed) : ceiling.speed;
  limits.angular_speed = limits.speed * (ceiling.angular_speed / ceiling.speed);
  limits.workspace_min = from(c.workspace_min);
  limits.workspace_max = from(c.workspace_max);
  return limits;
}

h6DeviceCommand OutputGuard::pass(const h6Wrench& wanted, double dt, h6Status* status) {
  Vec3 force = from(wanted.force), torque = from(wanted.torque);
  h6Cause cause = H6_CAUSE_NONE;
  if (!force.allFinite() || !torque.allFinite()) fault(H6_CAUSE_NOT_FINITE);
  if (fault_ != H6_CAUSE_NONE) {
    *status |= H6_OUTPUT_FAULT;
    force_.setZero();
    torque_.setZero();
    return {.wrench = {}, .pose = {{0, 0, 0}, {1, 0, 0, 0}}, .velocity = {}, .cause = fault_, .causes = 0};
  }
  const bool force_cut = clamp_norm(force, limits_.force),
             torque_cut = clamp_norm(torque, limits_.torque);
  if (force_cut || torque_cut) {
    *status |= H6_OUTPUT_CLAMPED;
    cause = H6_CAUSE_CLAMPED;
  }
  const bool force_slewed = slew(force, force_, limits_.force_rate * dt);
  const bool torque_slewed = slew(torque, torque_, limits_.torque_rate * dt);
  if (force_slewed || torque_slewed) {
    *status |= H6_OUTPUT_SLEWED;
    cause = H6_CAUSE_SLEWED;
  }
  force_ = force;
  torque_ = torque;
  return {.wrench = {to(force), to(torque)},
          .pose = {{0, 0, 0}, {1, 0, 0, 0}},
          .velocity = {},
          .cause = cause,
          .causes = 0};
}

h6DeviceCommand OutputGuard::pass_motion(const h6Pose& device, const h6BodyState& wanted, double dt,
                                         h6Status* status) {
  if (!moving_ && sane(device)) {
    x_ = from(device.p);
    q_ = from(device.q).normalized();
    moving_ = true;
  }
  Vec3 v = from(wanted.velocity.linear), w = from(wanted.velocity.angular);
  Vec3 x = from(wanted.pose.p);
  h6Cause cause = H6_CAUSE_NONE;
  // Without a place to start from there is no safe pose; a step so large that it overflows is none.
  if (!moving_ || !sane(wanted.pose) || !v.allFinite() || !w.allFinite() || !(x - x_).allFinite())
    fault(H6_CAUSE_NOT_FINITE);
  if (fault_ != H6_CAUSE_NONE) {
    *status |= H6_OUTPUT_FAULT;
    return {.wrench = {}, .pose = {to(x_), to(q_)}, .velocity = {}, .cause = fault_, .causes = 0};
  }
  if (clamp_to_box(x, v, limits_.workspace_min, limits_.workspace_max)) {
    *status |= H6_OUTPUT_CLAMPED;
    cause = H6_CAUSE_CLAMPED;
  }
  Vec3 turn = log_rotation(from(wanted.pose.q).normalized() * q_.conjugate());
  const bool too_fast = clamp_norm(v, limits_.speed),
             too_fast_turning = clamp_norm(w, limits_.angular_speed);
  const bool far = slew(x, x_, limits_.speed * dt),
             far_turned = clamp_norm(turn, limits_.angular_speed * dt);
  if (too_fast || too_fast_turning || far || far_turned) {
    *status |= H6_OUTPUT_SLEWED;
    cause = H6_CAUSE_SPEED;
  }
  x_ = x;
  // What is not limited goes out to the bit.
  if (far_turned)
    q_ = (exp_rotation(turn) * q_).normalized();
  else
    q_ = from(wanted.pose.q).norm() == 1 ? from(wanted.pose.q) : from(wanted.pose.q).normalized();
  return {.wrench = {}, .pose = {to(x_), to(q_)}, .velocity = {to(v), to(w)}, .cause = cause, .causes = 0};
}

}  // namespace h6
