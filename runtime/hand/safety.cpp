// SPDX-License-Identifier: Apache-2.0
// safety.cpp - limits from ratings, and the chain for wrenches and for motions.
#include "runtime/hand/safety.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

namespace h6 {
namespace {

constexpr unsigned kCauseShift = 8;  // of h6SafetyInput.asked

// v shortened to at most `most`; true when it was longer.
bool clamp_norm(Vec3& v, double most) {
  // stableNorm, because a finite vector whose square overflows must also come out at `most`.
  const double n = v.stableNorm();
  if (n <= most) return false;
  v *= most / n;
  // The product rounds, but the limit holds to the last bit.
  while (v.norm() > most) v *= 1 - 1e-15;
  return true;
}

bool slew(Vec3& v, const Vec3& last, double most) {
  Vec3 step = v - last;
  if (!clamp_norm(step, most)) return false;
  v = last + step;
  return true;
}

// An axis has a limit where min < max.
bool clamp_to_box(Vec3& x, Vec3& v, const Vec3& least, const Vec3& most) {
  bool cut = false;
  for (int i = 0; i < 3; ++i) {
    if (!(least[i] < most[i]) || (x[i] >= least[i] && x[i] <= most[i])) continue;
    // A device that follows the velocity must not pass through the wall.
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

// From the lightest cause to the gravest, which the command names.
constexpr h6Cause kGravity[] = {H6_CAUSE_PASSIVITY, H6_CAUSE_CLAMPED,    H6_CAUSE_SLEWED,
                                H6_CAUSE_CLUTCHED,  H6_CAUSE_SPEED,      H6_CAUSE_POWER,
                                H6_CAUSE_DERATED,   H6_CAUSE_SOFT_START, H6_CAUSE_DEAD_MAN,
                                H6_CAUSE_DISARMED,  H6_CAUSE_POSE_JUMP,  H6_CAUSE_LATE,
                                H6_CAUSE_FROZEN,    H6_CAUSE_BAD_SAMPLE};

h6Cause gravest(std::uint32_t causes) {
  h6Cause found = H6_CAUSE_NONE;
  for (const h6Cause cause : kGravity)
    if (causes >> cause & 1u) found = cause;
  return found;
}

// A setting only makes a limit tighter; 0 leaves it alone.
void tighten(double& limit, double asked) {
  if (asked > 0) limit = std::min(limit, asked);
}

}  // namespace

SafetyLimits limits_of(const h6DeviceCapabilities& c) {
  return limits_of(c, h6SafetyDef{.max_force = 0,
                                  .max_torque = 0,
                                  .max_force_rate = 0,
                                  .max_torque_rate = 0,
                                  .max_power = 0,
                                  .max_speed = 0,
                                  .derate_speed = 0,
                                  .cut_speed = 0,
                                  .soft_start = SafetyLimits{}.soft_start,
                                  .decay_time = 0,
                                  .pose_jump = 0,
                                  .freeze_time = 0,
                                  .dead_man_buttons = 0,
                                  .reserved = {}});
}

SafetyLimits limits_of(const h6DeviceCapabilities& c, const h6SafetyDef& def) {
  const SafetyLimits ceiling;
  SafetyLimits limits;
  // A negative rating or NaN is no rating: nothing is rendered.
  const auto rating = [](double value, double most) {
    return value > 0 ? std::min(value, most) : 0.0;
  };
  limits.force = rating(c.max_force, ceiling.force);
  limits.torque = rating(c.max_torque, ceiling.torque);
  tighten(limits.force, def.max_force);
  tighten(limits.torque, def.max_torque);
  limits.force_rate =
      std::min(c.max_force_rate > 0 ? c.max_force_rate : limits.force / 0.005, ceiling.force_rate);
  limits.torque_rate = std::min(c.max_torque_rate > 0 ? c.max_torque_rate : limits.torque / 0.005,
                                ceiling.torque_rate);
  tighten(limits.force_rate, def.max_force_rate);
  tighten(limits.torque_rate, def.max_torque_rate);
  limits.power = limits.force * 1.0;  // [N] at 1 m/s
  if (limits.force == 0) limits.power = limits.torque / kHandLever;
  tighten(limits.power, def.max_power);
  limits.speed = c.max_velocity > 0 ? std::min(c.max_velocity, ceiling.speed) : ceiling.speed;
  tighten(limits.speed, def.max_speed);
  limits.angular_speed = limits.speed / kHandLever;
  limits.cut_speed =
      c.max_velocity > 0 ? std::min(2 * c.max_velocity, ceiling.cut_speed) : ceiling.cut_speed;
  tighten(limits.cut_speed, def.cut_speed);
  limits.derate_speed = 0.5 * limits.cut_speed;
  if (def.derate_speed > 0) limits.derate_speed = std::min(def.derate_speed, limits.cut_speed);
  limits.soft_start = def.soft_start;
  tighten(limits.decay_time, def.decay_time);
  limits.workspace_min = from(c.workspace_min);
  limits.workspace_max = from(c.workspace_max);
  return limits;
}

AboveRating above_rating(const h6DeviceCapabilities& c, const h6SafetyDef& def) {
  const SafetyLimits most = limits_of(c);
  const AboveRating asked[] = {
      {"max_force", "N", def.max_force, most.force},
      {"max_torque", "N m", def.max_torque, most.torque},
      {"max_force_rate", "N/s", def.max_force_rate, most.force_rate},
      {"max_torque_rate", "N m/s", def.max_torque_rate, most.torque_rate},
      {"max_speed", "m/s", def.max_speed, most.speed},
      {"cut_speed", "m/s", def.cut_speed, most.cut_speed},
  };
  for (const AboveRating& a : asked)
    if (a.asked > a.rating) return a;
  return {};
}

void OutputGuard::fault(h6Cause cause) {
  if (fault_ != H6_CAUSE_NONE) return;
  fault_ = cause;
  asked_ |= static_cast<std::uint32_t>(cause) << kCauseShift;
}

void OutputGuard::disarm() {
  armed_ = false;
  asked_ |= H6_ASKED_DISARM;
}

void OutputGuard::repeat(std::uint32_t asked) {
  if (asked & H6_ASKED_ARM) {
    if (asked & H6_ASKED_FROM_FAULT) fault(H6_CAUSE_STOPPED);
    if (asked & H6_ASKED_FROM_DISARMED) disarm();
    arm();
  }
  if (asked & H6_ASKED_DISARM) disarm();
  const std::uint32_t cause = asked >> kCauseShift;
  if (cause > H6_CAUSE_NONE && cause < H6_CAUSE_COUNT) fault(static_cast<h6Cause>(cause));
}

void OutputGuard::arm() {
  if (!may_arm_) return;
  asked_ = H6_ASKED_ARM;
  if (fault_ != H6_CAUSE_NONE) asked_ |= H6_ASKED_FROM_FAULT;
  if (!armed_) asked_ |= H6_ASKED_FROM_DISARMED;
  // A latched motion starts again where the device is now.
  if (fault_ != H6_CAUSE_NONE) moving_ = false;
  if (!armed()) gain_ = 0;
  fault_ = H6_CAUSE_NONE;
  armed_ = true;
  trouble_ = 0;
}

void OutputGuard::restart() {
  disarm();
  moving_ = false;
  may_arm_ = true;
  gain_ = trouble_ = 0;
  force_.setZero();
  torque_.setZero();
}

void OutputGuard::rise(double dt) {
  gain_ = limits_.soft_start > 0 ? std::min(1.0, gain_ + dt / limits_.soft_start) : 1.0;
}

void OutputGuard::fall(double seconds) {
  gain_ = std::max(0.0, gain_ - seconds / limits_.decay_time);
  if (gain_ < 1e-9) gain_ = 0;  // sums of dt round
}

// Adds `seconds` of trouble. During the first frame the output is held; then the gain falls, and
// after the whole decay time the trouble becomes a fault.
void OutputGuard::suffer(h6Cause cause, double seconds) {
  note_cause(cause);
  falling_ = cause;
  const double held = std::min(grace_, seconds);
  grace_ -= held;
  seconds -= held;
  trouble_ += seconds;
  fall(seconds);
  if (trouble_ >= limits_.decay_time - 1e-9) fault(cause);
}

void OutputGuard::note(const DeviceWatch& watch, bool lost, const Delay& delay, double dt) {
  const double overdue = delay.overdue, elapsed = dt + delay.missed;
  const bool hangs = watch.seen() && watch.frozen();
  may_arm_ = !lost && watch.seen() && watch.usable() && !hangs;
  speed_ = watch.speed();
  causes_ = 0;
  falling_ = H6_CAUSE_NONE;
  if (lost) asked_ |= H6_ASKED_LOST;
  input_ = {asked_, overdue};
  if (delay.missed > 0) input_ = {asked_ | H6_ASKED_SLOW, delay.missed};
  if (lost) fault(H6_CAUSE_DEVICE_LOST);
  if (overdue > 0) note_cause(H6_CAUSE_LATE);  // also after a fault of another cause
  const bool trouble = overdue > 0 || hangs || !watch.usable();
  if (!trouble) {
    grace_ = dt;
    trouble_ = 0;
  } else if (armed()) {
    if (!watch.held()) grace_ = 0;  // the gain falls already
    // The frame after the last command counts as no delay, once.
    if (overdue > 0) suffer(H6_CAUSE_LATE, grace_ > 0 ? overdue : overdue + dt);
    if (hangs) suffer(H6_CAUSE_FROZEN, elapsed);
    if (!watch.usable()) suffer(H6_CAUSE_BAD_SAMPLE, elapsed);
  }
  if (armed() && !trouble) {
    if (speed_ >= limits_.cut_speed && (watch.held() || gain_ > 0)) fault(H6_CAUSE_OVERSPEED);
    if (watch.held()) {
      rise(dt);
    } else {
      fall(elapsed);
      falling_ = H6_CAUSE_DEAD_MAN;
      note_cause(falling_);
    }
  }
  if (!armed_ && fault_ == H6_CAUSE_NONE) {
    fall(elapsed + overdue);
    falling_ = H6_CAUSE_DISARMED;
    note_cause(falling_);
  }
  if (watch.jumped() && armed()) {
    gain_ = 0;
    falling_ = H6_CAUSE_POSE_JUMP;
    note_cause(falling_);
  }
  if (fault_ != H6_CAUSE_NONE) gain_ = 0;

  state_ = lost                       ? H6_LOST
           : !watch.seen()            ? H6_ABSENT
           : hangs || !watch.usable() ? H6_DEGRADED
           : !armed()                 ? H6_READY
           : trouble                  ? H6_DEGRADED
           : watch.held()             ? H6_ACTIVE
                                      : H6_ARMED;
}

h6HandSafety OutputGuard::report() const {
  h6HandSafety report{};
  report.state = state_;
  report.fault = fault_;
  std::copy(std::begin(frames_), std::end(frames_), report.frames);
  std::copy(std::begin(times_), std::end(times_), report.times);
  return report;
}

h6DeviceCommand OutputGuard::finished(h6DeviceCommand command, h6Status* status) {
  if (fault_ != H6_CAUSE_NONE) {
    *status |= H6_OUTPUT_FAULT;
    causes_ |= 1u << fault_;
  }
  command.causes = causes_;
  command.cause = fault_ != H6_CAUSE_NONE ? fault_ : gravest(causes_);
  for (std::uint32_t rest = causes_; rest != 0; rest &= rest - 1) {
    const int cause = std::countr_zero(rest);
    ++frames_[cause];
    times_[cause] += (last_causes_ >> cause & 1u) == 0;
  }
  last_causes_ = causes_;
  asked_ = 0;  // a fault of this frame will occur again when the frame is repeated
  return command;
}

// A share falls at once, and never rises so fast that the wrench changes by more than the slew
// limit. With the former share it cannot, since the wrench before the share obeys the limit.
double OutputGuard::share_of(WrenchShare* rule, const Vec3& force, const Vec3& torque,
                             double dt) const {
  const double share = rule ? rule->share(force, torque) : 1;
  const bool jumps = (share * force - share_ * force_).norm() > limits_.force_rate * dt ||
                     (share * torque - share_ * torque_).norm() > limits_.torque_rate * dt;
  return share > share_ && jumps ? share_ : share;
}

h6DeviceCommand OutputGuard::pass(const h6Wrench& wanted, const h6Velocity& hand, double dt,
                                  h6Status* status, WrenchShare* rule) {
  h6DeviceCommand out{};
  out.pose.q.w = 1;
  Vec3 force = from(wanted.force), torque = from(wanted.torque);
  if (!force.allFinite() || !torque.allFinite()) fault(H6_CAUSE_NOT_FINITE);
  if (fault_ != H6_CAUSE_NONE) {
    force_.setZero();
    torque_.setZero();
    return finished(out, status);
  }
  const bool asked = !force.isZero(0) || !torque.isZero(0);
  const bool force_cut = clamp_norm(force, limits_.force),
             torque_cut = clamp_norm(torque, limits_.torque);
  if (force_cut || torque_cut) {
    *status |= H6_OUTPUT_CLAMPED;
    note_cause(H6_CAUSE_CLAMPED);
  }
  if (asked && gain_ < 1 && falling_ == H6_CAUSE_NONE) note_cause(H6_CAUSE_SOFT_START);
  double scale = gain_;
  if (speed_ > limits_.derate_speed) {
    const double room = limits_.cut_speed - limits_.derate_speed;
    scale *= room > 0 ? std::clamp((limits_.cut_speed - speed_) / room, 0.0, 1.0) : 0.0;
    if (asked) note_cause(H6_CAUSE_DERATED);
  }
  if (scale < 1) {
    force *= scale;
    torque *= scale;
  }
  const bool force_slewed = slew(force, force_, limits_.force_rate * dt);
  const bool torque_slewed = slew(torque, torque_, limits_.torque_rate * dt);
  if (force_slewed || torque_slewed) {
    *status |= H6_OUTPUT_SLEWED;
    note_cause(H6_CAUSE_SLEWED);
  }
  if (gain_ < 1) {
    clamp_norm(force, limits_.force * gain_);
    clamp_norm(torque, limits_.torque * gain_);
  }
  const double power = force.dot(from(hand.linear)) + torque.dot(from(hand.angular));
  if (power > limits_.power) {
    force *= limits_.power / power;
    torque *= limits_.power / power;
    note_cause(H6_CAUSE_POWER);
  }
  share_ = share_of(rule, force, torque, dt);
  force_ = force;
  torque_ = torque;
  if (share_ < 1) {
    *status |= H6_PASSIVITY;
    note_cause(H6_CAUSE_PASSIVITY);
    force *= share_;
    torque *= share_;
  }
  out.wrench = {to(force), to(torque)};
  return finished(out, status);
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
  h6DeviceCommand out{};
  // No pose is safe without one to start from, or after a step so large that it overflows.
  if (!moving_ || !sane(wanted.pose) || !v.allFinite() || !w.allFinite() || !(x - x_).allFinite())
    fault(H6_CAUSE_NOT_FINITE);
  if (fault_ != H6_CAUSE_NONE) {
    out.pose = {to(x_), to(q_)};
    return finished(out, status);
  }
  if (clamp_to_box(x, v, limits_.workspace_min, limits_.workspace_max)) {
    *status |= H6_OUTPUT_CLAMPED;
    note_cause(H6_CAUSE_CLAMPED);
  }
  const double speed = limits_.speed * gain_, angular_speed = limits_.angular_speed * gain_;
  Vec3 turn = log_rotation(from(wanted.pose.q).normalized() * q_.conjugate());
  const bool too_fast = clamp_norm(v, speed), too_fast_turning = clamp_norm(w, angular_speed);
  const bool far = slew(x, x_, speed * dt), far_turned = clamp_norm(turn, angular_speed * dt);
  if (too_fast || too_fast_turning || far || far_turned) {
    *status |= H6_OUTPUT_SLEWED;
    note_cause(H6_CAUSE_SPEED);
    if (gain_ < 1 && falling_ == H6_CAUSE_NONE) note_cause(H6_CAUSE_SOFT_START);
  }
  x_ = x;
  // A rotation within the limit goes out bit for bit.
  if (far_turned)
    q_ = (exp_rotation(turn) * q_).normalized();
  else
    q_ = from(wanted.pose.q).norm() == 1 ? from(wanted.pose.q) : from(wanted.pose.q).normalized();
  out.pose = {to(x_), to(q_)};
  out.velocity = {to(v), to(w)};
  return finished(out, status);
}

}  // namespace h6
