#include "device/simulated_hand.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "device/path_device.h"

namespace h6::device {
namespace {

h6Vec3 operator+(const h6Vec3& a, const h6Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
h6Vec3 operator-(const h6Vec3& a, const h6Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
h6Vec3 operator*(double s, const h6Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
h6Vec3 cross(const h6Vec3& a, const h6Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

h6Quat product(const h6Quat& a, const h6Quat& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

h6Vec3 rotate(const h6Quat& q, const h6Vec3& v) {
  const h6Vec3 u{q.x, q.y, q.z}, t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}

// The rotation vector from a to b, world frame, angle in [0, pi].
h6Vec3 turn(const h6Quat& from, const h6Quat& to) {
  h6Quat d = product(to, {from.w, -from.x, -from.y, -from.z});
  if (d.w < 0) d = {-d.w, -d.x, -d.y, -d.z};
  const double n = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  const double scale = n < 1e-9 ? 2 : 2 * std::atan2(n, d.w) / n;
  return {scale * d.x, scale * d.y, scale * d.z};
}

h6Quat turned(const h6Quat& q, const h6Vec3& w) {
  const double angle = std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z);
  const double s = angle < 1e-6 ? 0.5 : std::sin(0.5 * angle) / angle;
  const h6Quat r = product({std::cos(0.5 * angle), s * w.x, s * w.y, s * w.z}, q);
  const double n = std::sqrt(r.w * r.w + r.x * r.x + r.y * r.y + r.z * r.z);
  return {r.w / n, r.x / n, r.y / n, r.z / n};
}

}  // namespace

Result<std::unique_ptr<SimulatedHand>> SimulatedHand::open(HandPath path, const Arm& arm) {
  if (Outcome good = check_path(path); !good) return good.failure();
  for (double v : {arm.mass, arm.inertia})
    if (!(v > 0)) return Failure{"a simulated arm needs a mass and an inertia above 0"};
  for (double v : {arm.stiffness, arm.damping, arm.rotational_stiffness, arm.rotational_damping})
    if (!(v >= 0)) return Failure{"the springs and dampers of a simulated arm must be 0 or more"};
  return std::unique_ptr<SimulatedHand>(new SimulatedHand(std::move(path), arm));
}

SimulatedHand::SimulatedHand(HandPath path, const Arm& arm) : path_(std::move(path)), arm_(arm) {
  const h6DeviceSample start = path_.at(path_.time.front());
  q_ = start.pose.q;
  x_ = start.pose.p + rotate(q_, arm_.grip);
}

// Implicit in spring and damper, so that any stiffness and any frame length is stable.
void SimulatedHand::advance(double time) {
  const double h = std::clamp(time - time_, 0.0, 0.1);
  time_ = time;
  if (h == 0) return;
  const h6DeviceSample want = path_.at(time);
  const h6Vec3 lever = rotate(want.pose.q, arm_.grip);
  const h6Vec3 xw = want.pose.p + lever;
  const h6Vec3 vw = want.velocity.linear + cross(want.velocity.angular, lever);
  const h6Wrench felt = stopped_.load(std::memory_order_relaxed) ? h6Wrench{} : felt_;

  const h6Vec3 force = arm_.stiffness * (xw - x_) + arm_.damping * (vw - v_) + felt.force;
  const double m = arm_.mass + h * arm_.damping + h * h * arm_.stiffness;
  // The spring's own change in this step, from the speed it already has.
  v_ = v_ + (h / m) * (force - (h * arm_.stiffness) * (v_ - vw));
  x_ = x_ + h * v_;

  const h6Vec3 torque = arm_.rotational_stiffness * turn(q_, want.pose.q) +
                        arm_.rotational_damping * (want.velocity.angular - w_) + felt.torque;
  const double I = arm_.inertia + h * arm_.rotational_damping + h * h * arm_.rotational_stiffness;
  w_ = w_ + (h / I) * (torque - (h * arm_.rotational_stiffness) * (w_ - want.velocity.angular));
  q_ = turned(q_, h * w_);
}

h6Device SimulatedHand::device() {
  h6Device d{};
  d.self = this;
  std::snprintf(d.capabilities.name, sizeof d.capabilities.name, "simulated");
  d.capabilities.dof_in = d.capabilities.dof_out = 6;
  d.capabilities.max_force = 30;  // of the order of a large desktop arm
  d.capabilities.max_torque = 3;
  d.capabilities.modes = H6_IMPEDANCE;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    auto& hand = *static_cast<SimulatedHand*>(self);
    hand.advance(time);
    const h6Vec3 lever = rotate(hand.q_, hand.arm_.grip);
    *out = {{hand.x_ - lever, hand.q_}, {hand.v_ - cross(hand.w_, lever), hand.w_}, 0};
    return 0;
  };
  d.write = [](void* self, double, const h6DeviceCommand* command) {
    static_cast<SimulatedHand*>(self)->felt_ = command->wrench;
    return 0;
  };
  d.stop = [](void* self) {
    static_cast<SimulatedHand*>(self)->stopped_.store(true, std::memory_order_relaxed);
  };
  return d;
}

}  // namespace h6::device
