// SPDX-License-Identifier: Apache-2.0
#include "device/simulated_arm.h"

#include <algorithm>
#include <cstdio>

#include "device/path_device.h"
#include "hapsix/vector.h"

namespace h6::device {
namespace {

constexpr double kInner = 1e-4;  // longest step of the drive [s]
constexpr double kTwoPi = 6.283185307179586;

// Servo and coupling are explicit in the measured state: with a step of 0.1 ms, 0.01 kg and
// 1e-5 kg m^2 the largest allowed values stay below a third of the limit of stability.
Outcome check_figures(const ArmFigures& a) {
  const struct {
    const char* name;
    double value, low, high;
    const char* unit;
  } all[] = {
      {"mass", a.mass, 0.01, 100, "kg"},
      {"inertia", a.inertia, 1e-5, 10, "kg m^2"},
      {"damping", a.damping, 0, 1e4, "N s/m"},
      {"rotational damping", a.rotational_damping, 0, 100, "N m s/rad"},
      {"stop stiffness", a.stop_stiffness, 0, 1e7, "N/m"},
      {"largest force", a.max_force, 0, 1e4, "N"},
      {"largest torque", a.max_torque, 0, 1e3, "N m"},
      {"largest velocity", a.max_velocity, 0, 100, "m/s"},
      {"position step", a.position_step, 0, 0.01, "m"},
      {"angle step", a.angle_step, 0, 0.1, "rad"},
      {"force step", a.force_step, 0, 10, "N"},
      {"torque step", a.torque_step, 0, 1, "N m"},
      {"velocity filter", a.velocity_filter, 10, 1e4, "Hz"},
      {"delay", static_cast<double>(a.delay_frames), 0, 2, "frames"},
      {"driver's stiffness", a.driver_stiffness, 0, 1e5, "N/m"},
      {"driver's damping", a.driver_damping, 0, 50, "N s/m"},
      {"driver's rotational stiffness", a.driver_rotational_stiffness, 0, 100, "N m/rad"},
      {"driver's rotational damping", a.driver_rotational_damping, 0, 0.05, "N m s/rad"},
      {"servo frequency", a.servo_frequency, 1, 200, "Hz"},
      {"person's mass", a.person.mass, 1e-3, 100, "kg"},
      {"person's inertia", a.person.inertia, 1e-6, 10, "kg m^2"},
      {"person's stiffness", a.person.stiffness, 0, 1e6, "N/m"},
      {"person's damping", a.person.damping, 0, 1e5, "N s/m"},
      {"person's rotational stiffness", a.person.rotational_stiffness, 0, 1e4, "N m/rad"},
      {"person's rotational damping", a.person.rotational_damping, 0, 1e3, "N m s/rad"},
      {"grip stiffness", a.grip_stiffness, 0, 1e6, "N/m"},
      {"grip damping", a.grip_damping, 0, 1e5, "N s/m"},
      {"grip's rotational stiffness", a.grip_rotational_stiffness, 0, 1e4, "N m/rad"},
      {"grip's rotational damping", a.grip_rotational_damping, 0, 1e3, "N m s/rad"},
  };
  for (const auto& f : all)
    if (!(f.low <= f.value && f.value <= f.high)) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "the %s of the simulated arm is %g but must be at least %g and at most %g %s",
                    f.name, f.value, f.low, f.high, f.unit);
      return Failure{text};
    }
  const h6Vec3 &low = a.workspace_min, &high = a.workspace_max, size = high - low;
  const bool none = size.x == 0 && size.y == 0 && size.z == 0;
  if (!none && !(size.x > 0 && size.y > 0 && size.z > 0 && norm(size) < 1e6))
    return Failure{
        "the workspace of the simulated arm must be a box with its low corner below its high one"};
  if (!std::isfinite(norm(a.person.grip)))
    return Failure{"the grip of the simulated arm is not finite"};
  return Done{};
}

double rounded(double x, double step) { return step > 0 ? step * std::round(x / step) : x; }
h6Vec3 rounded(const h6Vec3& v, double step) {
  return {rounded(v.x, step), rounded(v.y, step), rounded(v.z, step)};
}

// Signed distance of x beyond the interval low .. high; 0 inside.
double beyond(double x, double low, double high) {
  return x < low ? x - low : x > high ? x - high : 0;
}

// Two masses in a row, one axis:  wanted ==[k, b]== second ==[k_grip, b_grip]== first.
struct Chain {
  double h;
  double m, b;            // mass and friction of the first
  double m2, k2, b2;      // mass of the second, spring and damper to its wanted place
  double k_grip, b_grip;  // spring and damper between the two

  // Implicit Euler for both speeds. gap: second minus first; gap2: wanted place minus second. A
  // stop of stiffness k_stop is compressed by `pressed`.
  void step(double force, double gap, double gap2, double v_wanted, double k_stop, double pressed,
            double& v, double& v2) const {
    const double link = h * (b_grip + h * k_grip);
    const double a11 = m + h * (b + h * k_stop) + link, a22 = m2 + h * (b2 + h * k2) + link;
    const double r1 = m * v + h * (force + k_grip * gap - k_stop * pressed);
    const double r2 = m2 * v2 + h * (k2 * gap2 + b2 * v_wanted - k_grip * gap);
    const double det = a11 * a22 - link * link;
    v = (a22 * r1 + link * r2) / det;
    v2 = (link * r1 + a11 * r2) / det;
  }
};

}  // namespace

Result<std::unique_ptr<SimulatedArm>> SimulatedArm::open(HandPath path, const ArmFigures& figures,
                                                         std::uint32_t mode) {
  if (Outcome good = check_path(path); !good) return good.failure();
  ArmFigures arm = figures;
  constexpr double lever2 = 0.03 * 0.03;
  if (arm.driver_rotational_stiffness == 0)
    arm.driver_rotational_stiffness = arm.driver_stiffness * lever2;
  if (arm.driver_rotational_damping == 0)
    arm.driver_rotational_damping = arm.driver_damping * lever2;
  if (Outcome good = check_figures(arm); !good) return good.failure();
  if (mode != H6_IMPEDANCE && mode != H6_ADMITTANCE && mode != H6_PSEUDO_ADMITTANCE)
    return Failure{
        "the simulated arm works in one mode at a time: impedance, admittance or "
        "pseudo-admittance"};
  return std::unique_ptr<SimulatedArm>(new SimulatedArm(std::move(path), arm, mode));
}

SimulatedArm::SimulatedArm(HandPath path, const ArmFigures& figures, std::uint32_t mode)
    : path_(std::move(path)), arm_(figures), mode_(mode) {
  const h6Pose start = path_.keyframe(path_.time.front()).pose;
  handle_.q = start.q;
  handle_.x = start.p + rotate(start.q, arm_.person.grip);
  hand_ = measured_ = handle_;
  measured_.x = rounded(handle_.x, arm_.position_step);
  for (h6DeviceCommand& command : written_) command.pose = start;  // hold still until told
}

void SimulatedArm::advance(double time) {
  const double passed = std::clamp(time - time_, 0.0, 0.1);
  time_ = time;
  if (passed == 0) return;
  const int steps = std::max(1, static_cast<int>(std::ceil(passed / kInner - 1e-6)));
  const double h = passed / steps, start = time - passed;
  for (int i = 1; i <= steps; ++i) {
    step(h, path_.at(i < steps ? start + i * h : time), motors());
    measure(h);
  }
}

// One step of handle and hand under the motors' wrench.
void SimulatedArm::step(double h, const h6DeviceSample& want, const h6Wrench& motors) {
  const Arm& p = arm_.person;
  const h6Vec3 lever = rotate(want.pose.q, p.grip);
  const h6Vec3 v_want = want.velocity.linear + cross(want.velocity.angular, lever);
  const h6Vec3 gap = hand_.x - handle_.x, gap2 = want.pose.p + lever - hand_.x;
  const Chain line{h,           arm_.mass, arm_.damping,        p.mass,
                   p.stiffness, p.damping, arm_.grip_stiffness, arm_.grip_damping};
  const h6Vec3 &low = arm_.workspace_min, &high = arm_.workspace_max;
  const auto axis = [&](double h6Vec3::*i) {
    const double out = low.*i < high.*i ? beyond(handle_.x.*i, low.*i, high.*i) : 0;
    line.step(motors.force.*i, gap.*i, gap2.*i, v_want.*i, out != 0 ? arm_.stop_stiffness : 0, out,
              handle_.v.*i, hand_.v.*i);
  };
  axis(&h6Vec3::x), axis(&h6Vec3::y), axis(&h6Vec3::z);

  const h6Vec3 twist = turn(handle_.q, hand_.q), twist2 = turn(hand_.q, want.pose.q);
  const Chain ring{h,
                   arm_.inertia,
                   arm_.rotational_damping,
                   p.inertia,
                   p.rotational_stiffness,
                   p.rotational_damping,
                   arm_.grip_rotational_stiffness,
                   arm_.grip_rotational_damping};
  for (double h6Vec3::*i : {&h6Vec3::x, &h6Vec3::y, &h6Vec3::z})
    ring.step(motors.torque.*i, twist.*i, twist2.*i, want.velocity.angular.*i, 0, 0, handle_.w.*i,
              hand_.w.*i);

  for (Mass* m : {&handle_, &hand_}) {
    m->x = m->x + h * m->v;
    m->q = turned(m->q, h * m->w);
  }
  grip_.force =
      arm_.grip_stiffness * (hand_.x - handle_.x) + arm_.grip_damping * (hand_.v - handle_.v);
  grip_.torque = arm_.grip_rotational_stiffness * turn(handle_.q, hand_.q) +
                 arm_.grip_rotational_damping * (hand_.w - handle_.w);
}

// Reads the encoders and estimates the speed from them.
void SimulatedArm::measure(double h) {
  const h6Vec3 x = rounded(handle_.x, arm_.position_step);
  // Rounded relative to the last reading, so that no orientation is special.
  const h6Vec3 turned_by = rounded(turn(measured_.q, handle_.q), arm_.angle_step);
  const double pass = 1 - std::exp(-kTwoPi * arm_.velocity_filter * h);
  measured_.v = measured_.v + pass * ((1 / h) * (x - measured_.x) - measured_.v);
  measured_.w = measured_.w + pass * ((1 / h) * turned_by - measured_.w);
  measured_.x = x;
  measured_.q = arm_.angle_step > 0 ? turned(measured_.q, turned_by) : handle_.q;
  if (arm_.exact_velocity) measured_.v = handle_.v, measured_.w = handle_.w;
}

// Spring and damper that pull the handle to the commanded pose, from measured values.
h6Wrench SimulatedArm::spring_to_command(double k, double b, double k_turn, double b_turn) const {
  const h6DeviceCommand& to = active();
  const h6Vec3 lever = rotate(to.pose.q, arm_.person.grip);
  const h6Vec3 v = to.velocity.linear + cross(to.velocity.angular, lever);
  return {k * (to.pose.p + lever - measured_.x) + b * (v - measured_.v),
          k_turn * turn(measured_.q, to.pose.q) + b_turn * (to.velocity.angular - measured_.w)};
}

// The motors' wrench on the handle.
h6Wrench SimulatedArm::motors() const {
  if (stopped_.load(std::memory_order_relaxed)) return {};
  h6Wrench out = active().wrench;
  if (mode_ == H6_ADMITTANCE) {
    const double w = kTwoPi * arm_.servo_frequency;
    out = spring_to_command(w * w * arm_.mass, 2 * w * arm_.mass, w * w * arm_.inertia,
                            2 * w * arm_.inertia);
  } else if (mode_ == H6_PSEUDO_ADMITTANCE) {
    out = spring_to_command(arm_.driver_stiffness, arm_.driver_damping,
                            arm_.driver_rotational_stiffness, arm_.driver_rotational_damping);
  }
  return {at_most(out.force, arm_.max_force), at_most(out.torque, arm_.max_torque)};
}

// The wrench that goes with a sample.
h6Wrench SimulatedArm::sensed() const {
  if (mode_ == H6_ADMITTANCE)
    return {rounded(grip_.force, arm_.force_step), rounded(grip_.torque, arm_.torque_step)};
  if (mode_ != H6_PSEUDO_ADMITTANCE) return {};
  const h6Wrench on_handle = motors();
  return {-1.0 * on_handle.force, -1.0 * on_handle.torque};
}

h6Device SimulatedArm::device() {
  h6Device d{};
  d.self = this;
  h6DeviceCapabilities& c = d.capabilities;
  std::snprintf(c.name, sizeof c.name, "arm");
  c.dof_in = c.dof_out = 6;
  c.max_force = arm_.max_force;
  c.max_torque = arm_.max_torque;
  c.max_velocity = arm_.max_velocity;
  c.workspace_min = arm_.workspace_min;
  c.workspace_max = arm_.workspace_max;
  c.modes = H6_IMPEDANCE | H6_ADMITTANCE | H6_PSEUDO_ADMITTANCE;
  c.frame_time = true;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    auto& arm = *static_cast<SimulatedArm*>(self);
    arm.advance(time);
    const Mass& m = arm.measured_;
    const h6Vec3 lever = rotate(m.q, arm.arm_.person.grip);
    *out = {};
    out->pose = {m.x - lever, m.q};
    out->velocity = {m.v - cross(m.w, lever), m.w};
    out->wrench = arm.sensed();
    return 0;
  };
  d.write = [](void* self, double, const h6DeviceCommand* command) {
    auto& written = static_cast<SimulatedArm*>(self)->written_;
    written = {*command, written[0], written[1]};
    return 0;
  };
  d.stop = [](void* self) {
    static_cast<SimulatedArm*>(self)->stopped_.store(true, std::memory_order_relaxed);
  };
  return d;
}

}  // namespace h6::device
