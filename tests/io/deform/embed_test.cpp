// SPDX-License-Identifier: Apache-2.0
// Modes at points: from the element that holds the point, and beyond the mesh.
#include <doctest/doctest.h>

#include <cmath>

#include "io/deform/reduced_model.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;

namespace {

// A model whose modes are given displacements of the vertices.
template <class Displacement>
ReducedModel with_modes(const SolidMesh& mesh, std::size_t modes, const Displacement& at) {
  ReducedModel model;
  model.mesh = mesh;
  model.modes = modes;
  for (const h6Vec3& p : mesh.vertices)
    for (std::size_t j = 0; j < modes; ++j) {
      const h6Vec3 d = at(j, p);
      model.basis.insert(model.basis.end(), {d.x, d.y, d.z});
    }
  return model;
}

h6Vec3 linear(std::size_t mode, const h6Vec3& p) {
  const double s = 1 + static_cast<double>(mode);
  return {s + 2 * p.y - p.z, s * p.x - 3, p.x + p.y + s * p.z};
}

}  // namespace

TEST_CASE("a displacement that is linear in space is met at every point, inside and outside") {
  const SolidMesh hexes = solids::shaken(solids::block({0.4, 0.3, 0.2}, {4, 3, 2}), 0.02);
  for (const SolidMesh& mesh : {hexes, solids::tetrahedra(hexes)}) {
    const ReducedModel model = with_modes(mesh, 3, linear);
    std::vector<h6Vec3> points;
    for (std::size_t i = 0; i < 500; ++i)
      points.push_back({0.2 + 0.25 * solids::noise(3, 3 * i),
                        0.15 + 0.2 * solids::noise(3, 3 * i + 1),
                        0.1 + 0.15 * solids::noise(3, 3 * i + 2)});
    points.insert(points.end(), mesh.vertices.begin(), mesh.vertices.end());
    double farthest = 0;
    const std::vector<double> modes = modes_at(model, points, &farthest);
    REQUIRE(modes.size() == points.size() * 9);
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const h6Vec3 expected = linear(j, points[i]);
        const double* got = modes.data() + (i * 3 + j) * 3;
        CHECK(norm(h6Vec3{got[0], got[1], got[2]} - expected) < 1e-9);
      }
    CHECK(farthest > 0.01);
    CHECK(farthest < 0.2);
  }
}

TEST_CASE("inside a hexahedron the displacement is trilinear, and all points are found inside") {
  const SolidMesh mesh = solids::block({0.4, 0.3, 0.2}, {4, 3, 2});
  const auto curved = [](std::size_t, const h6Vec3& p) {
    return h6Vec3{p.x * p.y * p.z, p.x * p.y, p.y * p.z};
  };
  const ReducedModel model = with_modes(mesh, 1, curved);
  std::vector<h6Vec3> points;
  for (std::size_t i = 0; i < 300; ++i)
    points.push_back({0.2 * (1 + solids::noise(5, 3 * i)), 0.15 * (1 + solids::noise(5, 3 * i + 1)),
                      0.1 * (1 + solids::noise(5, 3 * i + 2))});
  double farthest = 1;
  const std::vector<double> modes = modes_at(model, points, &farthest);
  CHECK(farthest < 1e-9);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const h6Vec3 expected = curved(0, points[i]);
    const double* got = modes.data() + i * 3;
    CHECK(norm(h6Vec3{got[0], got[1], got[2]} - expected) < 1e-9);
  }
}

TEST_CASE("turns of modes that are small turns of the whole are those turns, at every point") {
  for (const bool tets : {false, true}) {
    SolidMesh mesh = solids::shaken(solids::block({0.3, 0.1, 0.1}, {4, 2, 2}), 0.004);
    if (tets) mesh = solids::tetrahedra(mesh);
    ReducedModel model;
    model.mesh = mesh, model.modes = 3;
    for (const h6Vec3& p : mesh.vertices)
      for (const h6Vec3& axis : {h6Vec3{1, 0, 0}, h6Vec3{0, 1, 0}, h6Vec3{0, 0, 1}}) {
        const h6Vec3 u = cross(axis, p);
        model.basis.insert(model.basis.end(), {u.x, u.y, u.z});
      }
    model.turn = vertex_turns(mesh, model.basis, 3);
    const std::vector<double> turns = turns_at(model, {{0.1, 0.05, 0.02}, {0.5, 0.2, -0.1}});
    for (std::size_t i = 0; i < turns.size(); ++i)
      CHECK(std::fabs(turns[i] - (i % 9 % 4 == 0 ? 1 : 0)) < 1e-9);
  }
}
