// SPDX-License-Identifier: Apache-2.0
// industrial.h - generated industrial inputs: polygon soups like those that CAD systems export, the
// sound parts to be fitted into them, and what the construction knows about the soups.
#pragma once
#include <cstdint>
#include <vector>

#include "hapsix/types.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// Where a soup is solid and where it is not, as its construction knows. World frame [m].
struct IndustrialTruth {
  struct Probe {
    h6Vec3 p;
    std::int32_t part;  // index into part_names; -1: none
    double clearance;   // no triangle of the part (for `outside`: of any part) is nearer [m]
  };
  // Points in a solid that is closed, or whose missing triangles are narrower than one voxel.
  std::vector<Probe> inside;
  // Points in a solid that has one or more of the `holes`; they are inside once these are sealed.
  std::vector<Probe> behind_holes;
  // Points that a path connects to infinity, staying `clearance` away from every triangle.
  std::vector<Probe> outside;
  // Points on sheets without thickness; `clearance` is the distance to the sheet's edges.
  std::vector<Probe> sheets;

  struct Wire {
    std::int32_t part;
    std::vector<h6Vec3> line;  // centre line; the wire is solid from the first to the last point
    double radius;             // of the circle in which its cross sections are inscribed
  };
  std::vector<Wire> wires;

  struct Hole {
    std::int32_t part;
    h6Vec3 centre, normal;  // the normal points out of the solid
    double width;           // upper bound of the diameter of the largest ball that passes
    std::size_t triangles;  // how many are missing
  };
  std::vector<Hole> holes;       // wider than two voxels, narrower than five
  std::size_t narrow_holes = 0;  // single missing triangles, narrower than one voxel
  std::size_t duplicates = 0;    // added copies of triangles, with the same or opposite winding
  double voxel = 0;              // of a field of 1024 cells on the longest padded side [m]
};

struct IndustrialInput {
  Mesh mesh;
  IndustrialTruth truth;
};

// Meshes with part names, in the world frame of the scenes [m]. The truth always has wires, holes
// and counts; `probes` is about the number of probes of each kind.
IndustrialInput make_engine_bay(std::size_t probes = 0);    // 505,276 triangles, 0.9 m
IndustrialInput make_landing_gear(std::size_t probes = 0);  // 1,789,551 triangles, 2 m
// Closed meshes in the part's own frame [m]. The starter's pinion turns about z and its flange is
// z = 0; the actuator pushes along z. A closed mesh has an even number of triangles, so one of the
// actuator's is there twice.
Mesh make_starter_motor();  // 18,580 triangles
Mesh make_actuator();       // 25,191 triangles

}  // namespace h6::io
