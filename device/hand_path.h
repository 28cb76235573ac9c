// SPDX-License-Identifier: Apache-2.0
// hand_path.h - where a hand should be at a time: keyframes in memory.
//
// Devices receive arrays; files are read elsewhere.
#pragma once
#include <memory>
#include <vector>

#include "device/steering.h"
#include "hapsix/device.h"

namespace h6::device {

// Rows in order of time. Between rows: straight lines and slerp; before the first and after the
// last the hand is still.
struct HandPath {
  std::vector<double> time;  // [s], strictly increasing, at least one
  std::vector<h6Pose> pose;  // mesh frame of the body -> world, unit quaternions

  // Who may take the hand away from it; empty: nobody.
  std::shared_ptr<Steering> steering{};

  double duration() const { return time.empty() ? 0 : time.back(); }
  // Where it should be at t, which does not fall: pose and velocity; buttons only when steered.
  h6DeviceSample at(double t) const { return steering ? steering->at(*this, t) : keyframe(t); }
  h6DeviceSample keyframe(double t) const;
};

}  // namespace h6::device
