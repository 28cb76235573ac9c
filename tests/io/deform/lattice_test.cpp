// SPDX-License-Identifier: Apache-2.0
// Cubes that fill a closed surface.
#include "io/deform/lattice.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;

namespace {

Mesh box_mesh(const h6Vec3& low, const h6Vec3& high) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace

TEST_CASE("a box is filled with its cells, and the lattice can be simulated") {
  const Mesh box = box_mesh({0.01, 0, 0}, {0.41, 0.1, 0.2});
  Result<SolidMesh> lattice = make_lattice(box, 0.05);
  REQUIRE_MESSAGE(lattice, lattice.error());
  CHECK(lattice->elements.size() == 8 * 2 * 4);
  CHECK(lattice->vertices.size() == 9 * 3 * 5);
  CHECK_FALSE(check_solid(*lattice, true));  // no material yet
  REQUIRE(give_material(*lattice, "", solids::kRubber));
  const Result<SolidFacts> facts = check_solid(*lattice, true);
  REQUIRE_MESSAGE(facts, facts.error());
  CHECK(facts->volume == doctest::Approx(0.4 * 0.1 * 0.2));
  CHECK(facts->parts == 1);
}

TEST_CASE("every place inside the mesh lies in a cell that was kept, or within a cell of one") {
  const Mesh box = box_mesh({0, 0, 0}, {0.33, 0.21, 0.47});
  const Result<SolidMesh> lattice = make_lattice(box, 0.1);
  REQUIRE_MESSAGE(lattice, lattice.error());
  h6Vec3 low = lattice->vertices[0], high = low;
  for (const h6Vec3& p : lattice->vertices) low = min(low, p), high = max(high, p);
  CHECK((low.x <= 0 && low.y <= 0 && low.z <= 0));
  CHECK((high.x >= 0.33 && high.y >= 0.21 && high.z >= 0.47));
  CHECK(lattice->elements.size() == 4 * 3 * 5);
}

TEST_CASE("an open mesh, and cells too small or of no size, are refused with a sentence") {
  Mesh box = box_mesh({0, 0, 0}, {1, 1, 1});
  for (const double cell : {0.0, -1.0, std::nan(""), 1e-4, 1e-300}) {
    const auto lattice = make_lattice(box, cell);
    REQUIRE_FALSE(lattice);
    CHECK(lattice.error().ends_with("."));
  }
  CHECK(make_lattice(box, 100));
  box.triangles.pop_back();
  const auto open = make_lattice(box, 0.2);
  REQUIRE_FALSE(open);
  CHECK(open.error().find("open") != std::string::npos);
}
