// SPDX-License-Identifier: Apache-2.0
// steering.h - lets a user take the hand away from its path, move it, and give it back.
//
// While the user holds the hand, the path's time stands still. Given back, the hand glides to the
// point where it left the path and continues from there. It follows a wished pose like a critically
// damped spring, never faster than a calm hand, so a pointer that jumps does not make the part
// jump. A hand that was never taken follows its path to the bit.
#pragma once
#include <atomic>

#include "hapsix/device.h"
#include "sched/latest_value.h"

namespace h6::device {

struct HandPath;

class Steering {
 public:
  struct Wish {
    bool held = false;
    bool clutched = false;  // button 0
    bool placed = false;    // `pose` is the wanted pose; false: the hand stays where it is
    h6Pose pose{{0, 0, 0}, {1, 0, 0, 0}};
  };
  static constexpr double kMaxSpeed = 0.5, kMaxTurn = 4;  // [m/s], [rad/s]

  // For one thread, not the haptic one. The pose is finite, its quaternion unit.
  void wish(const Wish& wish) { wishes_.publish(wish); }
  // For the haptic thread, once a frame; `time` must not decrease [s].
  h6DeviceSample at(const HandPath& path, double time);

 private:
  void follow(const h6DeviceSample& goal, double h);
  sched::LatestValue<Wish> wishes_;
  Wish wish_;
  h6DeviceSample hand_{};  // the hand while it is off its path
  bool off_path_ = false;
  h6Pose goal_{{0, 0, 0}, {1, 0, 0, 0}};  // the last wanted pose, while held
  double time_ = 0;
  double away_ = 0;     // total time that the hand spent off its path [s]
  double left_at_ = 0;  // time on the path at which the hand left it [s]
};

}  // namespace h6::device
