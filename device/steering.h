// SPDX-License-Identifier: Apache-2.0
// steering.h - somebody takes the hand away from its path, moves it, and gives it back.
//
// While it is held the path's own time stands still; given back, the hand glides to where the path
// was left and goes on from there. It follows what is asked of it like a critically damped spring,
// never faster than a calm hand: a pointer that jumps does not make the part jump. A hand that was
// never taken follows its path to the bit.
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
    bool placed = false;    // `pose` is where it is wanted; else it stays where it is
    h6Pose pose{{0, 0, 0}, {1, 0, 0, 0}};
  };
  static constexpr double kMaxSpeed = 0.5, kMaxTurn = 4;  // [m/s], [rad/s]

  // One thread, not the haptic one. Finite, a unit quaternion.
  void wish(const Wish& wish) { wishes_.publish(wish); }
  // The haptic thread, once a frame, `time` not falling [s].
  h6DeviceSample at(const HandPath& path, double time);

 private:
  void follow(const h6DeviceSample& goal, double h);
  sched::LatestValue<Wish> wishes_;
  Wish wish_;
  h6DeviceSample hand_{};  // once it is off its path
  bool off_path_ = false;
  h6Pose goal_{{0, 0, 0}, {1, 0, 0, 0}};  // the last one, while held
  double time_ = 0;
  double away_ = 0;     // how long the hand was off its path so far [s]
  double left_at_ = 0;  // where on the path it left it [s]
};

}  // namespace h6::device
