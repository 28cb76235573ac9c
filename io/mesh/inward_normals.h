// SPDX-License-Identifier: Apache-2.0
// inward_normals.h - for every triangle of a mesh the unit normal that points into the body,
// however the mesh is wound.
#pragma once
#include <string>
#include <vector>

#include "io/file/pulse.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct FaceTable {
  std::vector<Vec3> inward;  // (triangles) unit; zero where area is 0
  std::vector<double> area;  // (triangles) [m^2]; 0: degenerate, or again a triangle seen before
  std::vector<char> sheet;   // (triangles) of a piece that does not close: it has two outer sides
  std::vector<char> bowl;    // (triangles) of such a piece that nearly closes around a volume
  std::size_t pieces = 0, sheets = 0;  // with area; those of them that do not close
  std::vector<std::string> warnings;   // a sentence each: what was repaired or is not certain
};

// Indices must be in range and vertices finite. Closed pieces are oriented by their volume, hollows
// inside them by their winding against the piece around them. Open pieces: by the volume they
// nearly enclose; sheets that enclose none keep the winding most of their area has.
// After the pulse stopped the table is of no use.
FaceTable face_table(const Mesh& mesh, Pulse* pulse = nullptr);

}  // namespace h6::io
