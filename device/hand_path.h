// hand_path.h - where a hand should be at a time: keyframes in memory.
//
// Devices receive arrays; files are read elsewhere.
#pragma once
#include <vector>

#include "hapsix/device.h"

namespace h6::device {

// Rows in order of time. Between rows: straight lines and slerp; before the first and after the
// last the hand is still.
struct HandPath {
  std::vector<double> time;  // [s], strictly increasing, at least one
  std::vector<h6Pose> pose;  // mesh frame of the body -> world, unit quaternions

  double duration() const { return time.empty() ? 0 : time.back(); }
  h6DeviceSample at(double t) const;  // pose and velocity, no buttons
};

}  // namespace h6::device
