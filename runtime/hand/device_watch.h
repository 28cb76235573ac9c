// SPDX-License-Identifier: Apache-2.0
// device_watch.h - what a hand's samples say about its device: is it there, does it hang, did it
// jump, how fast is it.
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

  // Every frame of `dt` seconds, as the device gave it; `usable`: it is numbers.
  void see(const h6DeviceSample& sample, bool usable, double dt);

  bool seen() const { return seen_; }      // a usable sample has come, in some frame
  bool usable() const { return usable_; }  // in this one
  bool jumped() const { return jumped_; }  // farther than a hand can have moved
  bool frozen() const { return frozen_; }  // the same sample for too long
  bool held() const { return held_; }      // the dead-man button, where there is one
  // The larger of what the device says and what its poses say over some 10 ms [m/s].
  double speed() const { return speed_; }

 private:
  bool hangs(const h6DeviceSample& sample, double dt);
  double jump_ = 0.02, freeze_time_ = 0;
  bool simulated_ = false;
  std::uint32_t dead_man_ = 0;
  bool seen_ = false, usable_ = false, jumped_ = false, frozen_ = false, held_ = true;
  h6DeviceSample last_{{{0, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0};  // the last usable one
  double since_ = 0;                                              // then [s]
  double same_for_ = 0;                                           // [s]
  Vec3 drift_ = Vec3::Zero(), spin_ = Vec3::Zero();  // velocities of the poses, smoothed
  double speed_ = 0;
};

}  // namespace h6
