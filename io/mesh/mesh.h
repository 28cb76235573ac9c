// SPDX-License-Identifier: Apache-2.0
// mesh.h - a triangle mesh in memory, and an audit of its defects.
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

// After read_mesh every index is in range, every vertex is finite, and vertices are welded exactly
// (equal coordinates are one vertex). Triangles without area are kept, because they carry edges.
struct Mesh {
  std::vector<Vec3> vertices;  // [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::int32_t> part;  // (triangles) index into part_names; empty: one part
  std::vector<std::string> part_names;
  std::vector<std::string> remarks;  // sentences about what was left out or seems wrong
  bool unit_is_doubtful = false;     // it is more than 20 m across if its numbers are metres
};

// The box around all vertices [m]. The mesh has at least one.
struct MeshBounds {
  Vec3 low, high;
  double longest() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};
MeshBounds bounds_of(const Mesh& mesh);

// A sentence when neighbouring floats near the box low..high [m] (the coordinates of an STL, the
// points of a shell) are more than a 20th of a voxel apart at 256 voxels; else empty. Fields do not
// need it: their origin is double, and their samples are small.
std::string too_far_for_floats(const Vec3& low, const Vec3& high);
std::string too_far_for_floats(const Mesh& mesh);

// The mesh, rotated and then translated by `pose`.
Mesh moved(const Mesh& mesh, const h6Pose& pose);

// The same triangles in the same order over welded vertices: equal coordinates (-0 is +0) are one
// vertex, unused vertices are removed, and the others stand in the order in which triangles first
// name them. Meshes of read_mesh are welded; generated ones may need it. Indices must be in range.
Mesh weld(const Mesh& mesh);

// Edges are counted after the exact weld and without duplicate triangles *of either winding*. They
// decide whether the mesh is closed: every edge has an even number of faces (METHOD.md, Sec. 5). A
// triangle with two equal vertices has no edges; one with three vertices on a line has three.
struct MeshAudit {
  std::size_t triangles = 0;          // as read
  std::size_t vertices = 0;           // after the weld
  std::size_t duplicates = 0;         // same three vertices as an earlier triangle, in any order
  std::size_t degenerate = 0;         // two equal vertices, or no area
  std::size_t open_edges = 0;         // one face
  std::size_t nonmanifold_edges = 0;  // more than two faces
  std::size_t odd_edges = 0;          // an odd number of faces
  std::size_t flipped_edges = 0;      // two faces that run along it in the same direction
  std::size_t components = 0;         // joined by shared vertices
  bool closed = false;                // no odd edge, at least one triangle with area
  Vec3 low{}, high{};                 // bounding box [m]
  double volume = 0;                  // signed [m^3]; meaningful when closed and well wound
};

// Welds the mesh itself. Indices must be in range.
MeshAudit audit(const Mesh& mesh);

}  // namespace h6::io
