// SPDX-License-Identifier: Apache-2.0
// Walls and gaps of bodies of known thickness.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <utility>

#include "io/check/wall_thickness.h"

#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

Walls measure(const Mesh& mesh, unsigned threads = 2) {
  WallOptions options;
  options.places = 4000, options.threads = threads;
  auto walls = measure_walls(mesh, options);
  REQUIRE(walls);
  return *walls;
}

bool near(double a, double b, double tolerance) { return std::fabs(a - b) <= tolerance; }

Mesh reversed(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

}  // namespace

TEST_CASE("a slab is as thick as it is, however it lies and is wound, far from the origin or not") {
  const Mesh slab = box({0, 0, 0}, {10, 10, 0.25});
  for (const Mesh& mesh : {slab, reversed(slab), turned(slab, 0.5, 1.1),
                           shifted(turned(slab, 0.5, 1.1), {1000, 2000, 0})}) {
    const Walls w = measure(mesh);
    REQUIRE(w.thickness.size() == 4000);  // its narrow sides are 10 apart
    CHECK(near(w.thickness.front(), 0.25, 1e-6));
    CHECK(near(quantile(w.thickness, 0.5), 0.25, 1e-6));
    CHECK(near(w.thickness.back(), 10, 1e-5));
    CHECK(near(share_below(w.thickness, 1), 200.0 / 210, 0.02));
    CHECK(w.gap.empty());
    CHECK(w.sheets == 0);
    CHECK(w.buried == 0);
  }
}

TEST_CASE("of a hollow ball it is the wall, across the hollow it is a gap") {
  Mesh ball = sphere({0, 0, 0}, 1.0, 40);
  add(ball, reversed(sphere({0, 0, 0}, 0.8, 40)));
  const Walls w = measure(ball);
  CHECK(w.thickness.size() > 3900);
  CHECK(near(w.thickness.front(), 0.2, 0.01));
  CHECK(near(w.thickness.back(), 0.2, 0.01));
  REQUIRE(!w.gap.empty());  // from the inner wall to the inner wall
  CHECK(near(double(w.gap.size()) / 4000, 0.64 / 1.64, 0.03));
  CHECK(near(quantile(w.gap, 0.5), 1.6, 0.02));
}

TEST_CASE("parts that overlap are one wall; what lies within is buried; what lies apart is a gap") {
  Mesh two = box({0, 0, 0}, {4, 4, 1});
  add(two, box({0.001, 0.001, 0.8}, {3.999, 3.999, 2}));
  Walls w = measure(two);
  CHECK(w.buried > 0.2);                              // two of four large faces, and strips
  CHECK(near(quantile(w.thickness, 0.25), 2, 1e-5));  // through both

  Mesh apart = box({0, 0, 0}, {4, 4, 1});
  add(apart, box({0, 0, 1.125}, {4, 4, 2}));
  w = measure(apart);
  CHECK(w.buried == 0);
  REQUIRE(!w.gap.empty());
  CHECK(near(w.gap.front(), 0.125, 1e-6));
  CHECK(near(w.gap.back(), 0.125, 1e-6));
}

TEST_CASE("a wedge has all thicknesses down to its edge; a needle's tip is a corner, not a wall") {
  Mesh wedge;  // 1 high at x = 0, 0 at x = 10
  wedge.vertices = {{0, 0, 0}, {0, 0, 1}, {10, 0, 0}, {0, 8, 0}, {0, 8, 1}, {10, 8, 0}};
  wedge.triangles = {{0, 1, 2}, {3, 5, 4}, {0, 2, 3}, {3, 2, 5},
                     {1, 4, 2}, {4, 5, 2}, {0, 3, 1}, {1, 3, 4}};
  REQUIRE(audit(wedge).closed);
  const Walls w = measure(wedge);
  CHECK(w.thickness.front() < 0.02);
  // Evenly spread over the two large faces, which are most of it.
  CHECK(near(share_below(w.thickness, 0.25), 0.25 * 160.4 / (160.4 + 18), 0.03));
}

TEST_CASE("sheets have no thickness; a box with a small hole is measured as if it had none") {
  const Walls sheet = measure(patch(4, 4, [](double s, double t) {
    return Vec3{s, t, 0.002 * s * t};
  }));
  CHECK(sheet.sheets == 1);
  CHECK(sheet.thickness.empty());
  CHECK(sheet.gap.empty());

  Mesh shards;  // one triangle each, anywhere: sheets, and each counts once
  Random random(3);
  for (std::uint32_t i = 0; i < 200; ++i) {
    for (int k = 0; k < 3; ++k)
      shards.vertices.push_back({random(-1, 1), random(-1, 1), random(-1, 1)});
    for (int twice = 0; twice < 2; ++twice)
      shards.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  CHECK(measure(shards).sheets == 1);

  Mesh holed = box({0, 0, 0}, {4, 4, 0.5}, 8);
  holed.triangles.resize(holed.triangles.size() - 1);
  const Walls w = measure(holed);
  CHECK(w.sheets == 0);
  CHECK(w.bowls == 1);
  CHECK(w.thickness.size() > 3800);
  CHECK(near(quantile(w.thickness, 0.5), 0.5, 1e-5));
}

TEST_CASE(
    "triangles that are there twice, lines and empty meshes change nothing and break nothing") {
  Mesh slab = box({0, 0, 0}, {10, 10, 0.25});
  const Walls before = measure(slab);
  const Mesh copy = slab;
  slab.triangles.insert(slab.triangles.end(), copy.triangles.begin(), copy.triangles.end());
  slab.triangles.push_back({0, 0, 1});
  const Walls w = measure(slab);
  REQUIRE(!w.thickness.empty());
  CHECK(near(quantile(w.thickness, 0.5), 0.25, 1e-6));
  CHECK(w.sheets == 0);
  CHECK(w.gap.empty());
  CHECK(measure(Mesh{}).thickness.empty());
  const Walls one = measure(copy, 1);
  CHECK(one.thickness == before.thickness);  // any number of threads
}
