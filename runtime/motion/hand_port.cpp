// SPDX-License-Identifier: Apache-2.0
// hand_port.cpp - reads a device's sample and makes its command, each frame. METHOD.md, Sec. 4.
//
//   sample -> watch -> finite? -> filter -> the frame's hand ... wrench or motion -> filter ->
//   safety -> command
#include <algorithm>
#include <utility>

#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

// The device's velocity at the point that torques are about.
h6Velocity hand_velocity(const HandDevice& device, const Body& body) {
  const h6DeviceSample& at = device.filter.device();
  if (body.translation_only) return at.velocity;
  const Vec3 w = from(at.velocity.angular);
  return {to(Vec3(from(at.velocity.linear) + w.cross(from(at.pose.q) * body.com))), to(w)};
}

// Passes the state of the device to the output guard before anything else. Returns whether the
// sample is good.
bool watched(HandDevice& device, const h6DeviceSample& given, double dt, h6Status& status) {
  const bool finite = usable(given.pose, given.velocity), good = finite && !device.lost;
  if (device.lost) status |= H6_DEVICE_LOST;
  if (!finite) status |= H6_HAND_NOT_FINITE;
  device.watch.see(given, good, dt + device.overdue + device.missed);
  device.guard.note(device.watch, device.lost, {device.overdue, device.missed}, dt);
  device.lost = false;
  device.overdue = device.missed = 0;
  return good;
}

}  // namespace

void set_rating(HandDevice& device, const h6DeviceCapabilities& capabilities) {
  device.guard.set_limits(limits_of(capabilities, device.safety));
  device.watch.set(device.safety, capabilities);
}

void note_interval(HandDevice& device, double dt, double seconds, double lasted) {
  device.overdue = seconds > 2 * dt ? std::min(seconds, kMost) - dt : 0;
  device.missed = device.overdue == 0 && lasted > 1.5 * dt ? std::min(lasted, kMost) - dt : 0;
}

void accept(HandDevice& device, Hand& hand, const Body& body, const h6DeviceSample& given,
            double dt, h6Status& status) {
  h6DeviceSample sample = given;
  const bool good = watched(device, given, dt, status);
  hand.cut_off = device.guard.holds();
  if (good) {
    sample.pose.q = to(from(given.pose.q).normalized());
  } else {
    if (!hand.seen) return;
    sample = device.filter.device();
    sample.velocity = {};
    sample.wrench = given.wrench;
  }
  if (device.watch.frozen()) sample.velocity = {};
  if (hand.mode == H6_IMPEDANCE) {
    sample.wrench = {};
  } else if (!usable(given.wrench)) {
    status |= H6_HAND_NOT_FINITE;
    sample.wrench = {};
  }
  // The hand moves a manipulandum with mass, or the body itself.
  const RigidState& state =
      hand.mode == H6_PSEUDO_ADMITTANCE ? std::as_const(hand.manipulandum) : body;
  const h6Pose here = mesh_pose(body, state);
  const h6Pose before = hand.sample.pose;
  hand.sample = device.filter.to_scene(sample, here, &hand.clutched);
  // A held body may be behind its hand.
  hand.start = !hand.seen                    ? hand.sample.pose
               : body.motion == Motion::held ? mesh_pose(body)
                                             : before;
  hand.seen = true;
}

void send(HandDevice& device, Hand& hand, Body& body, double dt, h6DeviceCommand* command,
          h6Status& status) {
  OutputGuard& guard = device.guard;
  if (status & H6_STATE_NOT_FINITE) guard.fault(H6_CAUSE_NOT_FINITE);
  h6DeviceCommand passed;
  if (hand.clutched) guard.note_cause(H6_CAUSE_CLUTCHED);
  if (hand.mode == H6_IMPEDANCE) {
    const h6Wrench felt{to(Vec3(-hand.wrench.head<3>())), to(Vec3(-hand.wrench.tail<3>()))};
    h6Wrench told = device.filter.to_device(felt);
    if (damp_hand(device, hand, told, dt)) {
      status |= H6_PASSIVITY;
      guard.note_cause(H6_CAUSE_PASSIVITY);
    }
    passed = guard.pass(told, hand_velocity(device, body), dt, &status,
                        device.passivity ? &device.port : nullptr);
    passed.pose = mesh_pose(body, hand.manipulandum);
  } else {
    RigidState& state = hand.mode == H6_PSEUDO_ADMITTANCE ? hand.manipulandum : body;
    const h6BodyState wanted =
        device.filter.to_device({mesh_pose(body, state), mesh_velocity(body, state)});
    passed = guard.pass_motion(device.filter.device().pose, wanted, dt, &status);
    follow_device(device, body, state, wanted, passed, dt);
  }
  note_command(device, hand, passed);
  if (command) *command = passed;
}

}  // namespace h6
