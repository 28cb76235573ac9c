// SPDX-License-Identifier: Apache-2.0
// hand_path.h - the wanted pose of a hand over time: keyframes in memory.
//
// Devices get arrays; io reads the files.
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

  // May take the hand away from its path; empty: the path alone counts.
  std::shared_ptr<Steering> steering{};

  double duration() const { return time.empty() ? 0 : time.back(); }
  // Wanted pose and velocity at time t [s], which must not decrease; buttons only when steered.
  h6DeviceSample at(double t) const { return steering ? steering->at(*this, t) : keyframe(t); }
  h6DeviceSample keyframe(double t) const;
};

}  // namespace h6::device
