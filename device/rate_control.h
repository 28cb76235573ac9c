// SPDX-License-Identifier: Apache-2.0
// rate_control.h - deflection of a sprung cap in, hand pose out: the cap's deflection is the hand's
// velocity, which is integrated here, once a frame.
//
//   axes -1..1 -> scale -> dominant axis -> dead zone -> curve -> low-pass -> velocity -> pose
//                                            felt wrench -> slows what pushes against it
//
// A cap has no end stops: without yielding, a hand that is pushed into a wall for a second would
// have to be pulled back for a second before the part follows again.
#pragma once
#include <array>
#include <cstdint>

#include "hapsix/device.h"
#include "hapsix/result.h"

namespace h6::device {

struct RateFigures {
  double speed = 0.1;       // at full deflection, 0 .. 10 [m/s]
  double turn_speed = 1.0;  // at full deflection, 0 .. 100 [rad/s]
  double dead_zone = 0.06;  // of full deflection that counts as none, 0 .. 0.9
  double curve = 2;         // exponent, 1 (straight) .. 5 (fine in the middle)
  std::array<double, 6> scale{1, 1, 1, 1, 1, 1};  // of each axis, -10 .. 10; 0: off; < 0: reversed
  bool dominant = false;                          // only the axis that is deflected most
  bool y_up = false;        // the world's up: z (right x, away y) or y (right x, away -z)
  double smoothing = 0.02;  // time constant, so that 16 ms between reports are not felt, 0 .. 1 [s]
  std::uint32_t clutch_buttons = 1u << 0;  // held: the hand stays where it is
  std::uint32_t reset_buttons = 1u << 1;   // pressed: the hand goes home at full speed
  // Motion against a felt wrench goes down to none at these; 0: no matter what is felt. [N], [N m]
  double yield_force = 0, yield_torque = 0;
};

// A sentence that names the figure when one is out of range.
Outcome check_rate_figures(const RateFigures& figures);

class RateControl {
 public:
  // `home`: pose of the mesh frame where it starts. `grip`: what it turns about, mesh frame [m].
  RateControl(const RateFigures& figures, const h6Pose& home, const h6Vec3& grip);

  // The hand after `dt` seconds (at most 0.1 are counted) with these axes: -1 .. 1, what is beyond
  // is cut, what is not finite counts as 0; in the device's frame (spacemouse_report.h). `felt`: on
  // the hand, world frame.
  h6DeviceSample step(const std::array<double, 6>& axes, std::uint32_t buttons,
                      const h6Wrench& felt, double dt);
  // Velocity is forgotten, the pose stays: after the cap was gone.
  void halt() { velocity_ = {}, homing_ = false; }

 private:
  std::array<double, 6> shaped(const std::array<double, 6>& axes);
  h6Velocity wanted(const std::array<double, 6>& shaped) const;
  h6Velocity homewards(double dt) const;

  RateFigures figures_;
  h6Vec3 grip_, home_x_, x_;  // the grip's position, world frame
  h6Quat home_q_, q_;
  h6Velocity velocity_{};
  std::uint32_t buttons_ = 0;
  int dominant_ = -1;
  bool homing_ = false;
};

}  // namespace h6::device
