// SPDX-License-Identifier: Apache-2.0
// bakes.h - our bake beside OpenVDB's, of the same mesh with the same voxel.
#pragma once
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::peers {

struct BakeRow {
  std::string mesh;
  std::size_t triangles = 0;
  double voxel = 0;                      // [m]
  double ours_ms[2]{}, openvdb_ms[2]{};  // on one thread, on two: medians
  std::size_t ours_bricks = 0, openvdb_bricks = 0;
  // Largest error of the distance at nodes of the narrow band, and how many were asked [voxel].
  double ours_error = 0, openvdb_error = 0;
  std::size_t nodes = 0;
};

// Bakes in turn, after one of each kind that is not timed. Fails when a distance of ours is
// wrong by more than a thousandth of a voxel.
Result<BakeRow> compare_bakes(const std::string& scene);

}  // namespace h6::peers
