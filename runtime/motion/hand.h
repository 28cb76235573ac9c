// SPDX-License-Identifier: Apache-2.0
// hand.h - a hand: Hand is its coupling to a body, HandDevice its side towards the device.
#pragma once
#include "runtime/contact/body.h"
#include "runtime/hand/hand_filter.h"
#include "runtime/hand/safety.h"
#include "runtime/motion/passivity.h"

namespace h6 {

struct Hand {
  std::int32_t body = -1;
  std::uint32_t mode = H6_IMPEDANCE;
  bool seen = false;      // a good sample has arrived
  bool clutched = false;  // the device moves alone
  bool cut_off = false;   // the safety chain lets nothing out, and the device's wrench is ignored
  h6CouplingDef coupling{};                         // zeros are replaced by derived values
  double manipulandum_mass = 0.1;                   // [kg]
  double driver_stiffness = 0, driver_damping = 0;  // [N/m], [N s/m]
  h6DeviceSample sample{};  // the last good one, in the scene's frame and units
  // The hand moves from `start` to the sample's pose during a frame, and is at `now` in this step.
  h6Pose start{{0, 0, 0}, {1, 0, 0, 0}}, now{{0, 0, 0}, {1, 0, 0, 0}};
  RigidState manipulandum;     // where the hand holds the body's centre of mass; pseudo-admittance:
                               // a body of its own
  Vec6 wrench = Vec6::Zero();  // the hand's wrench on the body
};

struct HandDevice {
  HandFilter filter;
  double motion_scale = 1, rotation_scale = 1;  // from the device to the scene
  h6SafetyDef safety{};
  DeviceWatch watch;
  OutputGuard guard;
  // The caller sets these for the next frame.
  bool lost = false;   // the device could not be read or written
  double overdue = 0;  // how much too late the next command comes [s]
  double missed = 0;   // how much longer than dt the last frame lasted, its command in time [s]
  bool passivity = false;
  HandPort port;
};

void set_rating(HandDevice& device, const h6DeviceCapabilities& capabilities);
// `seconds`: the time from the last command to the next one, which is late when a frame is missing.
// `lasted`: the time from the begin of the last frame to that of the next one; 0: not known.
void note_interval(HandDevice& device, double dt, double seconds, double lasted = 0);

}  // namespace h6
