// SPDX-License-Identifier: Apache-2.0
// Distances where triangles share edges and corners in every way: a node is measured only against
// triangles that own the edge or corner nearest to it.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;

namespace {

// The worst error at nodes outside, within the band [voxel].
double worst_outside(const Mesh& mesh, int voxels) {
  FieldBake options;
  options.voxels = voxels;
  options.threads = 2;
  options.sign = h6::io::SignMode::flood;
  const auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  const Judge judge(mesh);
  double worst = 0;
  std::size_t nodes = 0;
  for_nodes(*field, [&](std::array<int, 3> n, double d) {
    if (d <= 0 || d > field->band) return;
    ++nodes;
    const double u = judge.distance(node_position(*field, n));
    worst = std::max(worst, std::fabs(d - (u - field->offset)) / field->voxel_size);
  });
  CHECK(nodes > 300);
  return worst;
}

// Random triangles over a few points: edges of many faces, corners of more.
Mesh random_complex(int seed, std::uint32_t points, std::size_t triangles, double flat) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < points; ++i)
    mesh.vertices.push_back({random(-1, 1), random(-1, 1), flat * random(-1, 1)});
  while (mesh.triangles.size() < triangles) {
    std::array<std::uint32_t, 3> t;
    for (std::uint32_t& v : t) v = std::uint32_t(random(0, points - 1e-9));
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  return mesh;
}

// A cone of `count` triangles around its tip, turned up or down.
Mesh fan(int count, double tip) {
  Mesh mesh;
  mesh.vertices.push_back({0, 0, tip});
  for (int i = 0; i < count; ++i)
    mesh.vertices.push_back({std::cos(2 * M_PI * i / count), std::sin(2 * M_PI * i / count), 0});
  for (int i = 0; i < count; ++i)
    mesh.triangles.push_back({0u, std::uint32_t(1 + i), std::uint32_t(1 + (i + 1) % count)});
  return mesh;
}

}  // namespace

TEST_CASE("bake_field: distances are exact whatever faces share an edge or a corner") {
  for (int seed = 1; seed <= 6; ++seed) {
    INFO("seed " << seed);
    CHECK(worst_outside(random_complex(seed, 12, 14, 1.0), 40) < 1e-3);
    CHECK(worst_outside(random_complex(seed, 40, 12, 1.0), 40) < 1e-3);
    CHECK(worst_outside(random_complex(seed, 9, 20, 0.05), 40) < 1e-3);
    CHECK(worst_outside(random_complex(seed, 30, 30, 1e-6), 40) < 1e-3);
  }
}

TEST_CASE("bake_field: distances are exact around tips with more triangles than are looked at") {
  for (int count : {3, 6, 47, 48, 49, 130})
    for (double tip : {0.0, 0.1, 1.5}) {
      INFO(count << " triangles, tip at " << tip);
      CHECK(worst_outside(fan(count, tip), 40) < 1e-3);
    }
}

TEST_CASE("bake_field: distances are exact beside slivers and where corners lie on edges") {
  Mesh strip;  // slivers thinner and thinner, each on the next one's long edge
  for (int i = 0; i <= 12; ++i) {
    const double y = 0.5 * std::pow(0.4, i);
    strip.vertices.push_back({-1, y, 0.1 * y});
    strip.vertices.push_back({1, y, 0.2 * y});
  }
  for (std::uint32_t i = 0; i < 12; ++i) {
    strip.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
    strip.triangles.push_back({2 * i + 1, 2 * i + 3, 2 * i + 2});
  }
  CHECK(worst_outside(strip, 64) < 1e-3);
  Mesh junction;
  junction.vertices = {{-1, 0, 0}, {1, 0, 0},      {0, 1, 0.3},
                       {0, 0, 0},  {0.3, -1, 0.2}, {-0.7, -0.9, 0}};
  junction.triangles = {{0, 1, 2}, {3, 1, 4}, {0, 3, 5}, {3, 4, 5}};
  CHECK(worst_outside(junction, 64) < 1e-3);
}
