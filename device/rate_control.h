// SPDX-License-Identifier: Apache-2.0
// rate_control.h - turns the deflection of a sprung cap into a hand pose: the deflection is the
// hand's velocity, which is integrated here once a frame.
//
//   axes -1..1 -> scale -> dominant axis -> dead zone -> curve -> low-pass -> velocity -> pose
//                                            felt wrench -> slows motion against it
//
// A cap has no end stops. Without yielding, a hand that was pushed into a wall for a second would
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
  bool dominant = false;                          // only the most deflected axis counts
  bool y_up = false;        // up in the world: z (right x, away y) or y (right x, away -z)
  double smoothing = 0.02;  // time constant that hides the 16 ms between reports, 0 .. 1 [s]
  std::uint32_t clutch_buttons = 1u << 0;  // held: the hand stays where it is
  std::uint32_t reset_buttons = 1u << 1;   // pressed: the hand goes home at full speed
  // Motion against a felt wrench falls linearly to zero at these values; 0: never. [N], [N m]
  double yield_force = 0, yield_torque = 0;
};

// Fails with a sentence that names a figure out of range.
Outcome check_rate_figures(const RateFigures& figures);

class RateControl {
 public:
  // `home`: pose of the mesh frame at the start. `grip`: centre of its turns, mesh frame [m].
  RateControl(const RateFigures& figures, const h6Pose& home, const h6Vec3& grip);

  // The hand after `dt` seconds, of which at most 0.1 count. `axes`: -1 .. 1 in the device's frame
  // (spacemouse_report.h); larger values are cut, values that are not finite count as 0. `felt`:
  // the wrench on the hand, world frame [N, N m].
  h6DeviceSample step(const std::array<double, 6>& axes, std::uint32_t buttons,
                      const h6Wrench& felt, double dt);
  // Sets the velocity to 0 and keeps the pose, for a cap that was unplugged.
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
