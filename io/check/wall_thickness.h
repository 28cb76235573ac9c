// SPDX-License-Identifier: Apache-2.0
// wall_thickness.h - how thick the walls of a mesh are and how wide its gaps, by rays from its
// surface against the normals of its triangles.
#pragma once
#include <cstdint>
#include <vector>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct WallOptions {
  std::size_t places = 20000;  // on the surface, evenly by area
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

// Ascending lengths [m], one for each place that has a face across, and shares of all places.
struct Walls {
  // From a place straight into the solid until it ends. Parts that overlap are one solid. Faces
  // that are not within 45 degrees of parallel make an edge or a corner, not a wall.
  std::vector<double> thickness;
  // From a place straight out to the next part, likewise.
  std::vector<double> gap;
  double bowls = 0;   // on pieces with holes that hold a volume: measured as if they were closed
  double sheets = 0;  // on other pieces that do not close: no thickness
  double buried = 0;  // within another part: neither wall nor gap
};

// Indices must be in range, vertices finite and welded as read_mesh does.
Result<Walls> measure_walls(const Mesh& mesh, const WallOptions& options);

// The length that `share` (0 to 1) of ascending lengths are below; 0 of none.
double quantile(const std::vector<double>& ascending, double share);
// The share of ascending lengths below a length; 0 of none.
double share_below(const std::vector<double>& ascending, double length);

}  // namespace h6::io
