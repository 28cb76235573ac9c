// SPDX-License-Identifier: Apache-2.0
// assembly.h - formats that are trees of nodes: shapes, where each is placed, and the mesh of
// all of them. Inside io only; glTF and COLLADA share it.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/mesh/formats.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// x -> A x + t, row by row; not orthogonal: scales may differ by axis, mirror, and nest.
struct Affine {
  std::array<std::array<double, 4>, 3> row{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};
Affine operator*(const Affine& outer, const Affine& inner);  // inner first
Vec3 operator*(const Affine& m, const Vec3& p);
bool mirrors(const Affine& m);  // det A < 0

Affine translation(double x, double y, double z);
Affine scaling(double x, double y, double z);
// Of a unit quaternion.
Affine rotation(double x, double y, double z, double w);

// One drawn thing, in its own frame and the file's unit; however often it is placed, read once.
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

// Nodes a file may have once all references are followed.
constexpr std::size_t kMaxNodes = 1'000'000;

// Every placed shape in order, one part each, welded. A mirrored shape is turned inside out by its
// transform, so its faces are listed backwards: what was outward stays outward. A few hundred bytes
// can place a shape billions of times: what it comes to is counted before anything is made.
Mesh expand(const std::vector<Placed>& placed, const MeshSource& source);

}  // namespace h6::io
