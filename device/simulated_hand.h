// SPDX-License-Identifier: Apache-2.0
// simulated_hand.h - a simulated person: a mass that spring and damper pull along a path, and that
// yields to the force it feels.
//
//     path ==[ k, b ]== hand (m) <-- force from the device
//
// Impedance mode: the commanded wrench acts on the hand, and the device reads the hand's pose.
#pragma once
#include <atomic>
#include <memory>

#include "device/hand_path.h"
#include "hapsix/result.h"

namespace h6::device {

// Order of magnitude of a relaxed human arm holding a stylus (Hogan 1989; Fu & Cavusoglu 2012).
struct Arm {
  double mass = 0.4;                // [kg]
  double stiffness = 500;           // [N/m]
  double damping = 20;              // [N s/m]
  double inertia = 1e-3;            // [kg m^2]
  double rotational_stiffness = 3;  // [N m/rad]
  double rotational_damping = 0.1;  // [N m s/rad]
  h6Vec3 grip{0, 0, 0};  // the body's centre of mass, about which torques act; mesh frame [m]
};

class SimulatedHand {
 public:
  // Fails with a sentence when the path is not valid (check_path), a mass is not above 0, or a
  // spring or damper is negative.
  static Result<std::unique_ptr<SimulatedHand>> open(HandPath path, const Arm& arm);
  h6Device device();

 private:
  SimulatedHand(HandPath path, const Arm& arm);
  void advance(double time);
  HandPath path_;
  Arm arm_;
  double time_ = 0;
  h6Vec3 x_{}, v_{}, w_{};  // the grip's position and the hand's velocities, world frame
  h6Quat q_{1, 0, 0, 0};
  h6Wrench felt_{};
  std::atomic<bool> stopped_{false};  // the device renders no force any more
};

}  // namespace h6::device
