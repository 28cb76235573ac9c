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
    return {.wrench = {}, .pose = {{0, 0, 0}, {1, 0, 0, 0}}, .velocity = {}, .cause = fault_};
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
          .cause = cause};
}

}  // namespace h6
