// SPDX-License-Identifier: Apache-2.0
// assembly.h - one mesh from shapes that nodes place, for glTF and COLLADA. Inside io/mesh only.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/mesh/formats.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// x -> A x + t, row by row. A need not be orthogonal: scales may differ by axis, and mirror.
struct Affine {
  std::array<std::array<double, 4>, 3> row{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};
Affine operator*(const Affine& outer, const Affine& inner);  // applies inner first
Vec3 operator*(const Affine& m, const Vec3& p);
bool mirrors(const Affine& m);  // det A < 0

Affine translation(double x, double y, double z);
Affine scaling(double x, double y, double z);
// The rotation of a unit quaternion.
Affine rotation(double x, double y, double z, double w);

// The polygons of one mesh or geometry, in its own frame and the file's unit.
struct Shape {
  std::vector<Vec3> points;
  std::vector<std::uint32_t> corners;  // in range
  std::vector<std::uint32_t> sizes;    // (faces) at least 3
};

struct Placed {
  const Shape* shape;
  Affine place;
  std::string part;
};

// The largest number of nodes of a file. A node counts once for each reference to it.
constexpr std::size_t kMaxNodes = 1'000'000;

// All placed shapes in order, one part each, welded. Faces of a mirrored shape are listed
// backwards, so that outward stays outward. A few hundred bytes can place a shape billions of
// times: sizes are summed and checked before anything is allocated.
Mesh expand(const std::vector<Placed>& placed, const MeshSource& source);

}  // namespace h6::io
