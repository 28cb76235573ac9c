// SPDX-License-Identifier: Apache-2.0
// inward_normals_test.cpp - normals point into the body, whatever its winding, and out of hollows.
#include <doctest/doctest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "io/mesh/inward_normals.h"
#include "io/shell/bake_shell.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

Mesh reversed(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

Mesh mixed(Mesh mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  return mesh;
}

// Concentric balls, the largest first; each is wound outward or not.
Mesh balls(const std::vector<bool>& outward) {
  Mesh mesh;
  for (std::size_t i = 0; i < outward.size(); ++i) {
    const Mesh one = sphere({3, -2, 1}, 1.0 - 0.2 * double(i), 8);
    add(mesh, outward[i] ? one : reversed(one));
  }
  return mesh;
}

// For each ball 1 when all normals point to its middle, -1 when all point away, else 0.
std::vector<int> pointing(const Mesh& mesh) {
  const FaceTable faces = face_table(mesh);
  const std::size_t each = sphere({0, 0, 0}, 1, 8).triangles.size();
  std::vector<int> out;
  for (std::size_t first = 0; first < mesh.triangles.size(); first += each) {
    std::size_t in = 0;
    for (std::size_t t = first; t < first + each; ++t)
      in += dot(faces.inward[t], Vec3{3, -2, 1} - mesh.vertices[mesh.triangles[t][0]]) > 0;
    out.push_back(in == each ? 1 : in == 0 ? -1 : 0);
  }
  return out;
}

}  // namespace

TEST_CASE("normals of a ball point into it, wound outward, inward or at random") {
  CHECK(pointing(balls({true})) == std::vector{1});
  CHECK(pointing(balls({false})) == std::vector{1});
  CHECK(pointing(mixed(balls({true}))) == std::vector{1});
}

TEST_CASE(
    "what is wound against the piece around it is a hollow, what is wound like it is a part") {
  CHECK(pointing(balls({true, false})) == std::vector{1, -1});
  CHECK(pointing(balls({false, true})) == std::vector{1, -1});  // all of it inside out
  CHECK(pointing(balls({true, true})) == std::vector{1, 1});
  CHECK(pointing(balls({false, false})) == std::vector{1, 1});
}

TEST_CASE("a ball in a hollow is a body again, and may be hollow itself") {
  CHECK(pointing(balls({true, false, true})) == std::vector{1, -1, 1});
  CHECK(pointing(balls({false, true, false})) == std::vector{1, -1, 1});
  CHECK(pointing(balls({true, false, true, false})) == std::vector{1, -1, 1, -1});
  CHECK(pointing(balls({true, true, false, false})) == std::vector{1, 1, 1, -1});
}

TEST_CASE("where windings are mixed, every second ball is a hollow") {
  CHECK(pointing(mixed(balls({true, true}))) == std::vector{1, -1});
  CHECK(pointing(mixed(balls({true, false, true}))) == std::vector{1, -1, 1});
}

TEST_CASE("a hollow beside another body, or larger than its box, is no hollow") {
  Mesh mesh = sphere({0, 0, 0}, 1, 8);
  add(mesh, reversed(sphere({3, 0, 0}, 0.5, 8)));    // beside it: inside out, turned
  add(mesh, reversed(sphere({0.9, 0, 0}, 0.5, 8)));  // half out of it: likewise
  const FaceTable faces = face_table(mesh);
  const std::size_t each = mesh.triangles.size() / 3;
  const Vec3 middle[3] = {{0, 0, 0}, {3, 0, 0}, {0.9, 0, 0}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    CHECK(dot(faces.inward[t], middle[t / each] - mesh.vertices[mesh.triangles[t][0]]) > 0);
  CHECK(faces.warnings.size() == 1);
}

TEST_CASE("the shell of a hollow ball with a hole has normals into its wall, outside and inside") {
  // A ball with a hollow, both joined by a tube: one closed piece that the outside reaches through.
  const int n = 48, m = 96;
  const double gap = 0.35;  // half angle of the opening [rad]
  const Mesh mesh = weld(patch(m, 2 * n + 2, [&](double s, double t) {
    const double around = 2 * M_PI * (s < 1 ? s : 0);
    const int k = int(std::lround(t * (2 * n + 2))) % (2 * n + 2);  // up outside, down inside
    const double polar = (M_PI - gap) * std::abs(k <= n ? n - k : k - n - 1) / n;
    const double r = k <= n ? 1.0 : 0.8, side = polar > 0 ? r * std::sin(polar) : 0;
    return Vec3{side * std::cos(around), side * std::sin(around), r * std::cos(polar)};
  }));
  REQUIRE(audit(mesh).closed);
  ShellBake options;
  options.points = 4000;
  const auto shell = bake_shell(mesh, options, nullptr);
  REQUIRE_MESSAGE(shell, shell.error());
  std::size_t outside = 0, inside = 0;
  for (std::size_t i = 0; i < shell->size(); ++i) {
    const Vec3 p{shell->x[i], shell->y[i], shell->z[i]},
        q{shell->nx[i], shell->ny[i], shell->nz[i]};
    if (std::fabs(norm(p) - 0.9) < 0.09) continue;  // the rim
    (norm(p) > 0.9 ? outside : inside)++;
    CHECK(dot(p, q) * (norm(p) > 0.9 ? -1 : 1) > -1e-6);  // the rim: 0
  }
  CHECK(outside > 1500);
  CHECK(inside > 1000);
}
