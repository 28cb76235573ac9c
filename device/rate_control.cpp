// SPDX-License-Identifier: Apache-2.0
#include "device/rate_control.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hapsix/vector.h"

namespace h6::device {
namespace {

// Removes from v a share of its component against the felt wrench f: all of it at |f| = `most`.
h6Vec3 yielding(const h6Vec3& v, const h6Vec3& f, double most) {
  const double n = norm(f);
  if (!(most > 0) || !(n > 0) || !std::isfinite(n)) return v;
  const h6Vec3 along = (1 / n) * f;
  const double against = std::min(0.0, dot(v, along));
  return v - (against * std::min(1.0, n / most)) * along;
}

h6Vec3 to_world(double x, double y, double z, bool y_up) {
  return y_up ? h6Vec3{x, -z, y} : h6Vec3{x, -y, -z};
}

}  // namespace

Outcome check_rate_figures(const RateFigures& f) {
  const struct {
    const char* name;
    double value, low, high;
    const char* unit;
  } all[] = {{"speed", f.speed, 0, 10, " m/s"},
             {"turn speed", f.turn_speed, 0, 100, " rad/s"},
             {"dead zone", f.dead_zone, 0, 0.9, ""},
             {"curve", f.curve, 1, 5, ""},
             {"smoothing", f.smoothing, 0, 1, " s"},
             {"yield force", f.yield_force, 0, 1e6, " N"},
             {"yield torque", f.yield_torque, 0, 1e6, " N m"},
             {"scale of x", f.scale[0], -10, 10, ""},
             {"scale of y", f.scale[1], -10, 10, ""},
             {"scale of z", f.scale[2], -10, 10, ""},
             {"scale of rx", f.scale[3], -10, 10, ""},
             {"scale of ry", f.scale[4], -10, 10, ""},
             {"scale of rz", f.scale[5], -10, 10, ""}};
  for (const auto& c : all)
    if (!(c.low <= c.value && c.value <= c.high)) {
      char text[160];
      std::snprintf(text, sizeof text, "the %s is %g but must be at least %g and at most %g%s",
                    c.name, c.value, c.low, c.high, c.unit);
      return Failure{text};
    }
  return Done{};
}

RateControl::RateControl(const RateFigures& figures, const h6Pose& home, const h6Vec3& grip)
    : figures_(figures), grip_(grip), home_q_(unit(home.q)), q_(home_q_) {
  home_x_ = x_ = home.p + rotate(q_, grip);
}

std::array<double, 6> RateControl::shaped(const std::array<double, 6>& axes) {
  std::array<double, 6> out{};
  for (std::size_t i = 0; i < 6; ++i)
    if (std::isfinite(axes[i])) out[i] = std::clamp(axes[i], -1.0, 1.0);
  if (figures_.dominant) {
    const auto size = [&](std::size_t i) { return std::fabs(out[i] * figures_.scale[i]); };
    std::size_t most = 0;
    for (std::size_t i = 1; i < 6; ++i)
      if (size(i) > size(most)) most = i;
    // A new axis must lead by a fifth, else the lock would flutter between two.
    if (dominant_ < 0 || size(most) > 1.2 * size(static_cast<std::size_t>(dominant_)))
      dominant_ = static_cast<int>(most);
    for (std::size_t i = 0; i < 6; ++i)
      if (static_cast<int>(i) != dominant_) out[i] = 0;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const double past =
        std::max(0.0, (std::fabs(out[i]) - figures_.dead_zone) / (1 - figures_.dead_zone));
    out[i] = figures_.scale[i] * std::copysign(std::pow(past, figures_.curve), out[i]);
  }
  return out;
}

h6Velocity RateControl::wanted(const std::array<double, 6>& a) const {
  return {figures_.speed * to_world(a[0], a[1], a[2], figures_.y_up),
          figures_.turn_speed * to_world(a[3], a[4], a[5], figures_.y_up)};
}

// Goes home at the largest speed that the figures allow, but never past home within a step.
h6Velocity RateControl::homewards(double dt) const {
  return {at_most((1 / dt) * (home_x_ - x_), figures_.speed),
          at_most((1 / dt) * turn(q_, home_q_), figures_.turn_speed)};
}

h6DeviceSample RateControl::step(const std::array<double, 6>& axes, std::uint32_t buttons,
                                 const h6Wrench& felt, double dt) {
  dt = dt > 0 ? std::min(dt, 0.1) : 0;
  const std::uint32_t pressed = buttons & ~buttons_;
  buttons_ = buttons;
  const std::array<double, 6> deflection = shaped(axes);
  const bool moved =
      std::any_of(deflection.begin(), deflection.end(), [](double d) { return d != 0; });
  if (pressed & figures_.reset_buttons) homing_ = true;
  if (moved || (buttons & figures_.clutch_buttons)) homing_ = false;
  if (dt > 0) {
    h6Velocity want = wanted(deflection);
    if (homing_) want = homewards(dt);
    if (buttons & figures_.clutch_buttons) {
      velocity_ = {};
    } else {
      want.linear = yielding(want.linear, felt.force, figures_.yield_force);
      want.angular = yielding(want.angular, felt.torque, figures_.yield_torque);
      const double pass =
          figures_.smoothing > 0 && !homing_ ? 1 - std::exp(-dt / figures_.smoothing) : 1;
      velocity_.linear = velocity_.linear + pass * (want.linear - velocity_.linear);
      velocity_.angular = velocity_.angular + pass * (want.angular - velocity_.angular);
      if (!moved && norm(velocity_.linear) < 1e-6 && norm(velocity_.angular) < 1e-6)
        velocity_ = {};  // else the low-pass would approach home for ever
    }
    x_ = x_ + dt * velocity_.linear;
    q_ = turned(q_, dt * velocity_.angular);
    if (homing_ && norm(home_x_ - x_) < 1e-9 && norm(turn(q_, home_q_)) < 1e-9) {
      homing_ = false;
      velocity_ = {};
    }
  }
  const h6Vec3 lever = rotate(q_, grip_);
  h6DeviceSample sample{};
  sample.pose = {x_ - lever, q_};
  sample.velocity = {velocity_.linear - cross(velocity_.angular, lever), velocity_.angular};
  sample.buttons = buttons;
  return sample;
}

}  // namespace h6::device
