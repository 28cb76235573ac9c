// SPDX-License-Identifier: Apache-2.0
#include "device/simulated_hand.h"

#include <algorithm>
#include <cstdio>

#include "device/path_device.h"
#include "hapsix/vector.h"

namespace h6::device {

Result<std::unique_ptr<SimulatedHand>> SimulatedHand::open(HandPath path, const Arm& arm) {
  if (Outcome good = check_path(path); !good) return good.failure();
  for (double v : {arm.mass, arm.inertia})
    if (!(v > 0)) return Failure{"a simulated arm needs a mass and an inertia above 0"};
  for (double v : {arm.stiffness, arm.damping, arm.rotational_stiffness, arm.rotational_damping})
    if (!(v >= 0)) return Failure{"the springs and dampers of a simulated arm must be 0 or more"};
  return std::unique_ptr<SimulatedHand>(new SimulatedHand(std::move(path), arm));
}

SimulatedHand::SimulatedHand(HandPath path, const Arm& arm) : path_(std::move(path)), arm_(arm) {
  const h6DeviceSample start = path_.keyframe(path_.time.front());
  q_ = start.pose.q;
  x_ = start.pose.p + rotate(q_, arm_.grip);
}

// Implicit in spring and damper, so that it is stable for any stiffness and any frame length.
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
  // The last term is the change of the spring's force during the step, at the present speed.
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
  d.capabilities.frame_time = true;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    auto& hand = *static_cast<SimulatedHand*>(self);
    hand.advance(time);
    const h6Vec3 lever = rotate(hand.q_, hand.arm_.grip);
    *out = {{hand.x_ - lever, hand.q_}, {hand.v_ - cross(hand.w_, lever), hand.w_}, 0, {}, 0, {}};
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
