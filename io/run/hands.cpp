// SPDX-License-Identifier: Apache-2.0
// hands.cpp - opens the devices of a scene's hands.
#include "io/run/hands.h"

#include "device/simulated_arm.h"
#include "io/mesh/mesh_file.h"

namespace h6::cli {
namespace {

device::HandPath hand_path(const io::SceneHand& hand, const h6Pose& start,
                           std::shared_ptr<device::Steering> steering) {
  device::HandPath path;
  path.steering = std::move(steering);
  for (const io::PathRow& row : hand.path) {
    path.time.push_back(row.t);
    path.pose.push_back(row.pose);
  }
  if (path.time.empty()) {  // a hand without a path holds the body in place
    path.time.push_back(0);
    path.pose.push_back(start);
  }
  return path;
}

device::ArmFigures arm_figures(const io::SceneHand& hand, const h6CouplingDef& coupling,
                               const h6Vec3& grip) {
  const io::SceneArm from = hand.arm.value_or(io::SceneArm{});
  device::ArmFigures to;
  to.mass = from.mass, to.inertia = from.inertia;
  to.damping = from.damping, to.rotational_damping = from.rotational_damping;
  to.workspace_min = from.workspace.low, to.workspace_max = from.workspace.high;
  to.stop_stiffness = from.stop_stiffness;
  to.max_force = from.max_force, to.max_torque = from.max_torque;
  to.max_velocity = from.max_velocity;
  to.position_step = from.position_step, to.angle_step = from.angle_step;
  to.force_step = from.force_step, to.torque_step = from.torque_step;
  to.exact_velocity = from.exact_velocity, to.velocity_filter = from.velocity_filter;
  to.delay_frames = from.delay_frames;
  to.servo_frequency = from.servo_frequency;
  if (hand.def.driver_stiffness > 0) {  // 0 means that the engine does not know the driver
    to.driver_stiffness = hand.def.driver_stiffness;
    to.driver_damping = hand.def.driver_damping;
  }
  const double lever2 = coupling.rotational_stiffness / coupling.stiffness;
  to.driver_rotational_stiffness = to.driver_stiffness * lever2;
  to.driver_rotational_damping = to.driver_damping * lever2;
  to.person = {from.person_mass,
               from.person_stiffness,
               from.person_damping,
               from.person_inertia,
               from.person_rotational_stiffness,
               from.person_rotational_damping,
               grip};
  to.grip_stiffness = from.grip_stiffness, to.grip_damping = from.grip_damping;
  to.grip_rotational_stiffness = from.grip_rotational_stiffness;
  to.grip_rotational_damping = from.grip_rotational_damping;
  return to;
}

void keep(OpenedDevice opened, Hands& out) {
  if (opened.real_time) out.real_time = opened.device.capabilities.name;
  out.devices.push_back(opened.device);
  out.alive.push_back(std::move(opened.alive));
}

// Opens the simulated arm with the figures of the scene.
Outcome open_arm(const io::SceneHand& hand, DevicePlace place, const h6CouplingDef& coupling,
                 Hands& out) {
  auto opened = device::SimulatedArm::open(std::move(place.path),
                                           arm_figures(hand, coupling, place.grip), hand.def.mode);
  if (!opened) return opened.failure();
  std::shared_ptr<device::SimulatedArm> arm = std::move(*opened);
  OpenedDevice device;
  device.device = arm->device();
  device.alive = std::move(arm);
  keep(std::move(device), out);
  return Done{};
}

Outcome open_hand(const io::SceneHand& hand, const h6BodyDef& body, const h6CouplingDef& coupling,
                  double unit, std::shared_ptr<device::Steering> steering, Hands& out) {
  if (Outcome known = check_device(hand.device); !known) return known;
  DevicePlace place;
  place.path = hand_path(hand, body.pose, std::move(steering));
  place.home = body.pose;
  // A body that never turns is held at the origin of its mesh frame.
  place.grip = body.translation_only ? h6Vec3{} : body.com;
  place.unit = unit;
  if (hand.device == "arm") return open_arm(hand, std::move(place), coupling, out);
  if (hand.def.mode != H6_IMPEDANCE && hand.device.rfind("plugin:", 0) != 0)
    return Failure{"the device '" + hand.device +
                   "' works in impedance mode only, choose that mode or the device 'arm'"};
  Result<OpenedDevice> opened = open_device(hand.device, place);
  if (!opened) return opened.failure();
  keep(std::move(*opened), out);
  return Done{};
}

}  // namespace

Result<Hands> open_hands(const io::LoadedScene& loaded, const std::vector<io::SceneHand>& hands,
                         h6Session* session, std::shared_ptr<device::Steering> steering) {
  Hands out;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    const auto index = static_cast<std::int32_t>(i);
    const auto body = static_cast<std::size_t>(loaded.body_index(hands[i].body));
    if (Outcome opened = open_hand(hands[i], loaded.bodies[body], h6GetCoupling(session, index),
                                   io::metres(loaded.scene.unit), i == 0 ? steering : nullptr, out);
        !opened)
      return Failure{"hand of '" + hands[i].body + "': " + opened.error()};
    h6SetRating(session, index, &out.devices[i].capabilities);
  }
  return out;
}

}  // namespace h6::cli
