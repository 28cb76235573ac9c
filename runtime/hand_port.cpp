// hand_port.cpp - what comes from a device and what goes to it, each frame. METHOD.md, Sec. 4.
//
//   sample -> finite? -> filter -> the frame's hand ... wrench or motion -> filter -> safety ->
//   command
#include "runtime/stages.h"

namespace h6 {
namespace {

// What moves where the hand wants it: a manipulandum with mass, or the body itself.
RigidState& follower(h6Session& s, Hand& hand) {
  if (hand.mode == H6_PSEUDO_ADMITTANCE) return hand.manipulandum;
  return s.bodies[hand.body];
}

}  // namespace

void accept(h6Session& s, Hand& hand, const h6DeviceSample& given) {
  h6DeviceSample sample = given;
  if (usable(given.pose, given.velocity)) {
    sample.pose.q = to(from(given.pose.q).normalized());
  } else {
    s.report.status |= H6_HAND_NOT_FINITE;
    if (!hand.seen) return;
    sample = hand.filter.device();
    sample.velocity = {};
    sample.wrench = given.wrench;
  }
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
  bool damped = false;
  if (hand.mode == H6_IMPEDANCE) {
    const h6Wrench felt{to(Vec3(-hand.wrench.head<3>())), to(Vec3(-hand.wrench.tail<3>()))};
    h6Wrench told = hand.filter.to_device(felt);
    damped = damp_hand(s, hand, told);
    passed = hand.guard.pass(told, s.dt, &s.report.status);
    passed.pose = mesh_pose(body, hand.manipulandum);
  } else {
    RigidState& state = follower(s, hand);
    const h6BodyState wanted =
        hand.filter.to_device({mesh_pose(body, state), mesh_velocity(body, state)});
    passed = hand.guard.pass_motion(hand.filter.device().pose, wanted, s.dt, &s.report.status);
    follow_device(hand, body, state, wanted, passed, s.dt);
  }
  note_command(s, hand, passed);
  // The safety chain's reasons come first; but a clutch is why a wrench is slewed to zero.
  const bool slewed = passed.cause == H6_CAUSE_SLEWED, none = passed.cause == H6_CAUSE_NONE;
  if (hand.clutched && (none || slewed)) passed.cause = H6_CAUSE_CLUTCHED;
  if (damped && none) passed.cause = H6_CAUSE_PASSIVITY;
  if (command) *command = passed;
}

}  // namespace h6
