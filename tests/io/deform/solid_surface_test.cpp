// SPDX-License-Identifier: Apache-2.0
// The outer faces of solid meshes.
#include "io/deform/solid_surface.h"

#include <doctest/doctest.h>

#include <set>

#include "hapsix/vector.h"
#include "tests/io/deform/solids.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::io;

namespace {

struct Measured {
  double area = 0,
         volume = 0;  // the volume by the divergence theorem: > 0 where faces look outside
};

Measured measure(const SolidMesh& mesh, const std::vector<std::uint32_t>& triangles) {
  Measured m;
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const h6Vec3 &a = mesh.vertices[triangles[i]], &b = mesh.vertices[triangles[i + 1]],
                 &c = mesh.vertices[triangles[i + 2]];
    m.area += 0.5 * norm(cross(b - a, c - a));
    m.volume += dot(a, cross(b, c)) / 6;
  }
  return m;
}

}  // namespace

TEST_CASE("the surface of a block closes it, looks outside and leaves out what is within") {
  SolidMesh bricks = solids::block({0.2, 0.03, 0.01}, {8, 3, 2});
  for (const SolidMesh& mesh : {bricks, solids::tetrahedra(bricks)}) {
    const std::vector<std::uint32_t> triangles = surface_of(mesh);
    const Measured m = measure(mesh, triangles);
    CHECK(m.area == test::near(2 * (0.2 * 0.03 + 0.2 * 0.01 + 0.03 * 0.01)));
    CHECK(m.volume == test::near(0.2 * 0.03 * 0.01));
    const std::set<std::uint32_t> used(triangles.begin(), triangles.end());
    CHECK(used.size() == mesh.vertices.size() - 7 * 2 * 1);  // those within
    CHECK(triangles.size() == 3 * 2 * 2 * (8 * 3 + 8 * 2 + 3 * 2));
  }
}

TEST_CASE("a mesh without elements has no surface, and one element all of its faces") {
  CHECK(surface_of({}).empty());
  CHECK(surface_of(solids::block({1, 1, 1}, {1, 1, 1})).size() == 36);
}
