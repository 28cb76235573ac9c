// SPDX-License-Identifier: Apache-2.0
// inward_normals.h - the normals of a mesh that point into the body, for any winding.
#pragma once
#include <string>
#include <vector>

#include "io/file/pulse.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct FaceTable {
  std::vector<Vec3> inward;  // (triangles) unit; zero where area is 0
  std::vector<double> area;  // (triangles) [m^2]; 0 when degenerate or a duplicate
  std::vector<char> sheet;   // (triangles) 1 in an open piece, which has two outer sides
  std::vector<char> bowl;    // (triangles) 1 in an open piece that nearly encloses a volume
  std::size_t pieces = 0;    // those with area
  std::size_t sheets = 0;    // the open ones among them
  std::vector<std::string> warnings;  // sentences about what was repaired or is uncertain
};

// Indices must be in range and vertices finite. Closed pieces are oriented by their volume, and
// hollows inside them by their winding against the piece around them. Open pieces are oriented by
// the volume that they nearly enclose; sheets without one keep the winding of most of their area.
// When the pulse stops, the table is incomplete.
FaceTable face_table(const Mesh& mesh, Pulse* pulse = nullptr);

}  // namespace h6::io
