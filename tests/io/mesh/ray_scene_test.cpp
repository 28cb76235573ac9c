// SPDX-License-Identifier: Apache-2.0
// Rays through a mesh: triangles that are there twice count once, lines do not count.
#include "io/mesh/ray_scene.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

using namespace h6::io;

TEST_CASE("ray_scene: of triangles with the same corners, in any order, a ray meets the first") {
  std::mt19937_64 random(8);
  Mesh mesh;
  constexpr std::uint32_t kColumns = 40;
  // A stack of triangles, each in a column of its own, so a ray along z meets one column only.
  std::vector<std::uint32_t> first(kColumns, RayScene::kNoTriangle);
  for (std::uint32_t c = 0; c < kColumns; ++c)
    for (const Vec3& v : {Vec3{2.0 * c, 0, 0}, Vec3{2.0 * c + 1, 0, 0}, Vec3{2.0 * c, 1, 0}})
      mesh.vertices.push_back(v);
  for (std::uint32_t t = 0; t < 400; ++t) {
    const auto c = std::uint32_t(random() % kColumns);
    std::array<std::uint32_t, 3> f{3 * c, 3 * c + 1, 3 * c + 2};
    std::shuffle(f.begin(), f.end(), random);
    if (random() % 5 == 0)
      f[2] = f[0];  // a line
    else if (first[c] == RayScene::kNoTriangle)
      first[c] = t;
    mesh.triangles.push_back(f);
  }
  const auto rays = RayScene::make(mesh);
  REQUIRE(rays);
  std::vector<Crossing> met;
  for (std::uint32_t c = 0; c < kColumns; ++c) {
    const Vec3 under{2.0 * c + 0.25, 0.25, -1};
    (*rays)->crossings(under, {0, 0, 1}, met);
    const bool any = first[c] != RayScene::kNoTriangle;
    REQUIRE(met.size() == (any ? 1 : 0));
    if (!any) continue;
    CHECK(met[0].triangle == first[c]);
    CHECK(met[0].t == doctest::Approx(1));
    CHECK((*rays)->nearest(under).triangle == first[c]);
  }
}
