// SPDX-License-Identifier: Apache-2.0
// simulated_arm.h - a simulated 6-DoF force-feedback arm with the flaws of real ones (friction,
// stops, quantisation, delay), and a person who holds it.
//
//     path ==[ k, b ]== hand (m) ==[ grip ]== handle (m) --- stops, friction, motors, encoders
//
// The mechanism turns about the grip; its inertia is the same in all directions. The drive runs at
// 10 kHz: encoders, velocity estimate, servo and the driver's coupling.
//
//   impedance          the motors give the commanded wrench
//   admittance         a position servo holds the handle at the commanded pose; the sample's wrench
//                      is what a sensor between handle and hand measures
//   pseudo-admittance  the motors give -F, the sample's wrench is F (METHOD.md, Sec. 4):
//                      F = k_dd (x_dev - x_m) + b_dd (v_dev - v_m), x_m the commanded pose
//
// Commands are delayed: one that is written in frame n acts for one frame, from n + delay on, so
// its effect is first read in frame n + 1 + delay. Samples are not delayed: only the total delay of
// the loop matters for stability.
//
// The person's springs and dampers, the friction and the stops are stepped implicitly, so the step
// is stable for any values. Servo and coupling use measured values, as in a real drive.
#pragma once
#include <array>
#include <atomic>
#include <memory>

#include "device/hand_path.h"
#include "device/simulated_hand.h"
#include "hapsix/result.h"

namespace h6::device {

// Defaults are of the order of a desktop arm for impedance and admittance control.
// simulated_arm.cpp lists the ranges.
struct ArmFigures {
  // Mechanism: handle and links as felt at the grip.
  double mass = 0.3;                                      // [kg]
  double inertia = 3e-4;                                  // [kg m^2]
  double damping = 1;                                     // [N s/m]
  double rotational_damping = 1e-3;                       // [N m s/rad]
  h6Vec3 workspace_min{0, 0, 0}, workspace_max{0, 0, 0};  // of the grip; equal: no stops [m]
  double stop_stiffness = 2e4;                            // [N/m]
  // Motors, in every mode.
  double max_force = 30, max_torque = 3;  // [N], [N m]
  double max_velocity = 2;                // largest commanded speed [m/s]; 0: not limited
  // Encoders and force sensor; a step of 0: ideal.
  double position_step = 1e-5;   // [m]
  double angle_step = 1e-4;      // [rad]
  double force_step = 0.01;      // [N]
  double torque_step = 1e-3;     // [N m]
  bool exact_velocity = false;   // false: differences of measured positions through a low-pass
  double velocity_filter = 200;  // corner of that low-pass [Hz]
  int delay_frames = 0;          // 0, 1 or 2: of the commands
  // The driver's own coupling (pseudo-admittance). Rotation 0: translation's value times (30 mm)^2.
  double driver_stiffness = 2000, driver_damping = 5;                     // [N/m], [N s/m]
  double driver_rotational_stiffness = 0, driver_rotational_damping = 0;  // [N m/rad], [N m s/rad]
  double servo_frequency = 100;  // admittance: natural frequency, critically damped [Hz]
  // The person: five parameters for translation, five for rotation (Fu & Cavusoglu 2012). The grip
  // is at the body's centre of mass.
  Arm person;
  double grip_stiffness = 1500, grip_damping = 8;                        // [N/m], [N s/m]
  double grip_rotational_stiffness = 5, grip_rotational_damping = 0.02;  // [N m/rad], [N m s/rad]
};

class SimulatedArm {
 public:
  // `mode` is one of H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE. Handle and hand start at
  // rest at the start of the path. Fails with a sentence that names a figure out of range.
  static Result<std::unique_ptr<SimulatedArm>> open(HandPath path, const ArmFigures& figures,
                                                    std::uint32_t mode);
  // The interface for a loop; valid while this object lives.
  h6Device device();

 private:
  struct Mass {
    h6Vec3 x{}, v{}, w{};  // world frame
    h6Quat q{1, 0, 0, 0};
  };
  SimulatedArm(HandPath path, const ArmFigures& figures, std::uint32_t mode);
  void advance(double time);
  void step(double h, const h6DeviceSample& want, const h6Wrench& motors);
  void measure(double h);
  h6Wrench motors() const;
  h6Wrench spring_to_command(double k, double b, double k_turn, double b_turn) const;
  h6Wrench sensed() const;
  const h6DeviceCommand& active() const {
    return written_[static_cast<std::size_t>(arm_.delay_frames)];
  }

  HandPath path_;
  ArmFigures arm_;
  std::uint32_t mode_;
  double time_ = 0;
  Mass handle_, hand_;
  Mass measured_;                             // the handle as measured by the drive
  h6Wrench grip_{};                           // of the hand on the handle
  std::array<h6DeviceCommand, 3> written_{};  // newest first
  std::atomic<bool> stopped_{false};          // the motors are off
};

}  // namespace h6::device
