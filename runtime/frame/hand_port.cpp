// SPDX-License-Identifier: Apache-2.0
// hand_port.cpp - what comes from a device and what goes to it, each frame. METHOD.md, Sec. 4.
//
//   sample -> watch -> finite? -> filter -> the frame's hand ... wrench or motion -> filter ->
//   safety -> command
#include "runtime/frame/stages.h"

namespace h6 {
namespace {

// What moves where the hand wants it: a manipulandum with mass, or the body itself.
RigidState& follower(h6Session& s, Hand& hand) {
  if (hand.mode == H6_PSEUDO_ADMITTANCE) return hand.manipulandum;
  return s.bodies[hand.body];
}

// Of the point that torques are about, as the device moves.
h6Velocity hand_velocity(const Hand& hand, const Body& body) {
  const h6DeviceSample& at = hand.filter.device();
  if (body.translation_only) return at.velocity;
  const Vec3 w = from(at.velocity.angular);
  return {to(Vec3(from(at.velocity.linear) + w.cross(from(at.pose.q) * body.com))), to(w)};
}

// What is known of the device decides on the output before anything else does.
bool watched(h6Session& s, Hand& hand, const h6DeviceSample& given) {
  const bool numbers = usable(given.pose, given.velocity), good = numbers && !hand.lost;
  if (hand.lost) s.report.status |= H6_DEVICE_LOST;
  if (!numbers) s.report.status |= H6_HAND_NOT_FINITE;
  hand.watch.see(given, good, s.dt);
  hand.guard.note(hand.watch, hand.lost, hand.overdue, s.dt);
  hand.lost = false;
  hand.overdue = 0;
  return good;
}

}  // namespace

void accept(h6Session& s, Hand& hand, const h6DeviceSample& given) {
  h6DeviceSample sample = given;
  if (watched(s, hand, given)) {
    sample.pose.q = to(from(given.pose.q).normalized());
  } else {
    if (!hand.seen) return;
    sample = hand.filter.device();
    sample.velocity = {};
    sample.wrench = given.wrench;
  }
  if (hand.watch.frozen()) sample.velocity = {};
  if (hand.mode == H6_IMPEDANCE) {
    sample.wrench = {};
  } else if (!finite(given.wrench)) {
    s.report.status |= H6_HAND_NOT_FINITE;
    sample.wrench = {};
  }
  const h6Pose here = mesh_pose(s.bodies[hand.body], follower(s, hand));
  hand.sample = hand.filter.to_scene(sample, here, &hand.clutched);
  hand.seen = true;
}

void send(h6Session& s, Hand& hand, h6DeviceCommand* command) {
  if (s.report.status & H6_STATE_NOT_FINITE) hand.guard.fault(H6_CAUSE_NOT_FINITE);
  const Body& body = s.bodies[hand.body];
  h6DeviceCommand passed;
  if (hand.clutched) hand.guard.note_cause(H6_CAUSE_CLUTCHED);
  if (hand.mode == H6_IMPEDANCE) {
    const h6Wrench felt{to(Vec3(-hand.wrench.head<3>())), to(Vec3(-hand.wrench.tail<3>()))};
    h6Wrench told = hand.filter.to_device(felt);
    if (damp_hand(s, hand, told)) hand.guard.note_cause(H6_CAUSE_PASSIVITY);
    passed = hand.guard.pass(told, hand_velocity(hand, body), s.dt, &s.report.status);
    passed.pose = mesh_pose(body, hand.manipulandum);
  } else {
    RigidState& state = follower(s, hand);
    const h6BodyState wanted =
        hand.filter.to_device({mesh_pose(body, state), mesh_velocity(body, state)});
    passed = hand.guard.pass_motion(hand.filter.device().pose, wanted, s.dt, &s.report.status);
    follow_device(hand, body, state, wanted, passed, s.dt);
  }
  note_command(s, hand, passed);
  if (command) *command = passed;
}

}  // namespace h6
