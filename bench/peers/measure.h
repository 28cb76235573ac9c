// SPDX-License-Identifier: Apache-2.0
// measure.h - runs all peers on one task and compares them.
#pragma once
#include <string>
#include <vector>

#include "bench/peers/peer.h"
#include "io/file/progress.h"

namespace h6::peers {

struct Quantiles {
  double p50 = 0, p99 = 0;
};
Quantiles quantiles(std::vector<double> values);  // zeros when there are none

struct Row {
  std::string peer;
  std::size_t poses = 0;     // slow peers get every eighth
  Quantiles path, shuffled;  // time of a pose [us]
  double contacts = 0;       // median
  // Against the exact result on the same surface, over the poses where that has contacts and so has
  // the peer. Missed: the share of poses deeper than a twentieth of a voxel with no contact.
  Quantiles depth;      // difference of the deepest contact's depth [voxel]
  Quantiles direction;  // angle between the sums of depth times direction [degree]
  double missed = 0;
  // From pose to pose in path order.
  Quantiles depth_change;      // of the deepest contact [voxel]
  Quantiles direction_change;  // [degree]
};

struct TaskReport {
  std::string name, about;
  std::size_t part_triangles = 0, obstacle_triangles = 0, points = 0;
  double voxel = 0, offset = 0;  // [m]
  std::size_t compared = 0;      // poses whose contacts were compared with brute force
  std::vector<Row> rows;         // the engine first; its search alone second
  std::vector<Row> truth;        // the exact change between frames, on the field and on triangles
};

// Fails, before any time is taken, when the engine's points inside are not those that OpenVDB finds
// by sampling every point.
Result<TaskReport> measure(const Task& task, const io::Progress& progress);

}  // namespace h6::peers
