// SPDX-License-Identifier: Apache-2.0
// wall_thickness.h - thickness of a mesh's walls and width of its gaps, by rays along the normals
// of its surface.
#pragma once
#include <cstdint>
#include <vector>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct WallOptions {
  std::size_t places = 20000;  // random places on the surface, uniform by area
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

// A place on the surface, the way into the solid (unit; of a sheet one of its two normals), and the
// thickness there [m]; 0 for sheets.
struct WallPlace {
  Vec3 p{}, in{};
  double thickness = 0;
};

// Lengths [m] in ascending order, one for each place with a face opposite, and shares of all
// places.
struct Walls {
  // From a place straight into the solid to its end. Parts that overlap or abut are one solid.
  // Faces that are not within 45 degrees of parallel make an edge or a corner, not a wall.
  std::vector<double> thickness;
  // From a place straight out to the next face, under the same rule for faces.
  std::vector<double> gap;
  double bowls = 0;   // on open pieces that hold a volume: measured as if they were closed
  double sheets = 0;  // on other open pieces: not measured
  double buried = 0;  // within another part, or between two that abut: not measured
  // Places to push at, not close to an edge: up to 96 among the thinnest tenth, without the
  // thinnest hundredth, and up to 96 among the others. A few rays graze an edge and see no wall:
  // that hundredth is theirs.
  std::vector<WallPlace> places;
};

// Indices must be in range, vertices finite and welded as read_mesh does.
Result<Walls> measure_walls(const Mesh& mesh, const WallOptions& options);

// The quantile of ascending lengths at `share` (0 to 1); 0 if there are none.
double quantile(const std::vector<double>& ascending, double share);
// The share of ascending lengths below `length`; 0 if there are none.
double share_below(const std::vector<double>& ascending, double length);

}  // namespace h6::io
