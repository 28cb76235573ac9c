// SPDX-License-Identifier: Apache-2.0
// device_watch.h - watches a device's samples: is it there, does it hang, did it jump, how fast is
// it?
#pragma once
#include "hapsix/device.h"
#include "runtime/base/math.h"

namespace h6 {

// A turn counts as the speed it has at the end of a hand's grip and forearm [m].
inline constexpr double kHandLever = 0.2;
// No hand is faster [m/s].
inline constexpr double kHandSpeed = 5;

class DeviceWatch {
 public:
  void set(const h6SafetyDef& def, const h6DeviceCapabilities& device);

  // Once a frame, `since` seconds after the last one, with the device's own sample. `usable`: it is
  // finite.
  void see(const h6DeviceSample& sample, bool usable, double since);

  bool seen() const { return seen_; }      // a usable sample has come in some frame
  bool usable() const { return usable_; }  // this frame's sample is usable
  bool jumped() const { return jumped_; }  // it is farther away than a hand can move
  bool frozen() const { return frozen_; }  // the sample has been the same for too long
  bool held() const { return held_; }      // the dead-man button is held, or there is none
  // The larger of the device's velocity and the velocity of its poses over some 10 ms [m/s].
  double speed() const { return speed_; }

 private:
  bool hangs(const h6DeviceSample& sample, double since);
  double jump_ = 0.02, freeze_time_ = 0;
  bool simulated_ = false;
  std::uint32_t dead_man_ = 0;
  bool seen_ = false, usable_ = false, jumped_ = false, frozen_ = false, held_ = true;
  h6DeviceSample last_{{{0, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0, {}};  // the last usable one
  double since_ = 0;                                              // time since last_ [s]
  double same_for_ = 0;                                           // [s]
  Vec3 drift_ = Vec3::Zero(), spin_ = Vec3::Zero();  // velocities of the poses, smoothed
  double speed_ = 0;
};

}  // namespace h6
