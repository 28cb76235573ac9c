// SPDX-License-Identifier: Apache-2.0
// mesh.h - a triangle mesh in memory, and what is wrong with it.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/vector.h"

namespace h6::io {

using Vec3 = h6Vec3;

// Vertices in metres. Triangles index them; after read_mesh every index is in range and every
// vertex finite, vertices are welded exactly (equal coordinates are one vertex), zero-area
// triangles are kept (they carry edges) but counted.
struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::int32_t> part;  // (triangles) index into part_names; empty: one part
  std::vector<std::string> part_names;
  std::vector<std::string> remarks;  // sentences: what was left out or seems wrong
};

// The box around all vertices, of which there is one at least [m].
struct MeshBounds {
  Vec3 low, high;
  double longest() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};
MeshBounds bounds_of(const Mesh& mesh);

// The mesh, turned and then shifted to where `pose` puts it.
Mesh moved(const Mesh& mesh, const h6Pose& pose);

// The same triangles in the same order over welded vertices: equal coordinates (-0 is +0) are one
// vertex, vertices no triangle uses are gone, the rest stand in the order in which the triangles
// first name them. read_mesh has done it; generated meshes may need it. Indices must be in range.
Mesh weld(const Mesh& mesh);

// Counts after the exact weld and after dropping duplicate triangles *ignoring winding*: what
// decides whether the mesh is closed (METHOD.md, Sec. 5: every edge has an even number of faces). A
// triangle with two equal vertices has no edges to count; one with three vertices in a line has,
// and they count.
struct MeshAudit {
  std::size_t triangles = 0;          // as read
  std::size_t vertices = 0;           // after the weld
  std::size_t duplicates = 0;         // same three vertices as an earlier triangle, in any order
  std::size_t degenerate = 0;         // two equal vertices, or no area
  std::size_t open_edges = 0;         // one face
  std::size_t nonmanifold_edges = 0;  // more than two faces
  std::size_t odd_edges = 0;          // an odd number of faces
  std::size_t flipped_edges = 0;      // two faces that run the same way along it
  std::size_t components = 0;         // joined by shared vertices
  bool closed = false;                // no odd edge, at least one triangle with area
  Vec3 low{}, high{};                 // bounding box [m]
  double volume = 0;                  // signed [m^3]; meaningful when closed and well wound
};

// Welds by itself. Indices must be in range.
MeshAudit audit(const Mesh& mesh);

}  // namespace h6::io
