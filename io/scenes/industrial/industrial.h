// SPDX-License-Identifier: Apache-2.0
// industrial.h - generated industrial inputs: polygon soups as CAD systems export them, the sound
// parts that are to be fitted into them, and what is known about the soups by construction.
#pragma once
#include <cstdint>
#include <vector>

#include "hapsix/types.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// Where a soup is solid and where it is not, known by construction. World frame [m].
struct IndustrialTruth {
  struct Probe {
    h6Vec3 p;
    std::int32_t part;  // index into part_names; -1: none
    double clearance;   // no triangle of the part (outside: of any part) is nearer [m]
  };
  // In a solid that is closed by itself, or whose missing triangles are narrower than one voxel.
  std::vector<Probe> inside;
  // In a solid that has one or more of the `holes`: inside once they are sealed.
  std::vector<Probe> behind_holes;
  // Connected to infinity by a path that stays `clearance` away from every triangle.
  std::vector<Probe> outside;
  // On sheets without thickness, away from their edges; clearance is the distance to those.
  std::vector<Probe> sheets;

  struct Wire {
    std::int32_t part;
    std::vector<h6Vec3> line;  // centre line; solid from its first to its last point
    double radius;             // of the circle that its cross sections are inscribed in
  };
  std::vector<Wire> wires;

  struct Hole {
    std::int32_t part;
    h6Vec3 centre, normal;  // the normal points out of the solid
    double width;           // diameter of the largest ball that passes, from above
    std::size_t triangles;  // missing
  };
  std::vector<Hole> holes;       // wider than two voxels, narrower than five
  std::size_t narrow_holes = 0;  // single triangles missing, narrower than one voxel
  std::size_t duplicates = 0;    // triangles that are there twice, with either winding
  double voxel = 0;              // of a field of 1024 cells on the longest padded side [m]
};

struct IndustrialInput {
  Mesh mesh;
  IndustrialTruth truth;
};

// Meshes with part names; mesh frames are the scenes' world, or the part's own. Wires, holes and
// counts of the truth are always there; the probes only when asked for, about so many of each kind.
IndustrialInput make_engine_bay(std::size_t probes = 0);    // 505,276 triangles, 0.9 m
IndustrialInput make_landing_gear(std::size_t probes = 0);  // 1,789,551 triangles, 2 m
// Closed. The starter's pinion turns about z, its flange is z = 0; the actuator pushes along z. An
// odd number of triangles cannot close: one of the actuator's is there twice.
Mesh make_starter_motor();  // 18,580 triangles
Mesh make_actuator();       // 25,191 triangles

}  // namespace h6::io
