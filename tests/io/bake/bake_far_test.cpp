// SPDX-License-Identifier: Apache-2.0
// The far grid at a million random points: safe everywhere, and tight. The band: as wide as asked.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;

namespace {

FieldBake small_bake(int voxels) {
  FieldBake options;
  options.voxels = voxels;
  options.threads = 2;
  return options;
}

FieldData must_bake(const Mesh& mesh, const FieldBake& options) {
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

}  // namespace

TEST_CASE(
    "bake_field: at a million random points the far bound is safe, and at its own nodes within "
    "a third of a voxel of the truth on average") {
  // Distances are 1-Lipschitz, so each corner's bound minus the way to it must be a bound too. At
  // the corners themselves the bound must be tight on average.
  const auto check = [](const Mesh& mesh, const FieldBake& options, int points) {
    const FieldData field = must_bake(mesh, options);
    const Judge judge(mesh);
    Random random(17);
    const double h = field.voxel_size;
    const std::size_t nx = std::size_t(field.bricks[0]) + 1, ny = std::size_t(field.bricks[1]) + 1;
    std::size_t unsafe = 0, corners = 0;
    double gap = 0;
    for (int i = 0; i < points; ++i) {
      const double g[3] = {random(0, field.bricks[0]), random(0, field.bricks[1]),
                           random(0, field.bricks[2])};  // in cells of 8 voxels
      const Vec3 p = field.origin + (8 * h) * Vec3{g[0], g[1], g[2]};
      const double u = judge.distance(p);
      double best = -1e9, side = 1;
      for (int c = 0; c < 8; ++c) {
        const std::size_t n[3] = {std::size_t(g[0]) + (c & 1), std::size_t(g[1]) + (c >> 1 & 1),
                                  std::size_t(g[2]) + std::size_t(c >> 2)};
        const double far = field.far_grid[(n[2] * ny + n[1]) * nx + n[0]];
        const Vec3 corner = field.origin + (8 * h) * Vec3{double(n[0]), double(n[1]), double(n[2])};
        if (std::fabs(far) - norm(corner - p) > best) {
          best = std::fabs(far) - norm(corner - p);
          side = far < 0 ? -1 : 1;
        }
        if (i % 20 == 0 && c == 0 && far > 0) {
          gap += (judge.distance(corner) - field.offset - far) / h;
          ++corners;
        }
      }
      unsafe += best > 0 && best > (side < 0 ? u + field.offset : u - field.offset) + 1e-9;
    }
    CHECK(unsafe == 0);
    CHECK(corners > 1000);
    CHECK(gap / double(corners) < 0.3);
    CHECK(gap >= 0);
    MESSAGE("loose by ", gap / double(corners), " voxel on average");
  };
  Mesh soup = turned(l_shape(1.0), 0.4, 0.3);
  soup.triangles.resize(soup.triangles.size() - 3);
  check(turned(l_shape(1.0), 0.4, 0.3), small_bake(128), 200000);
  check(torus(1.0, 0.3), small_bake(128), 200000);
  FieldBake flooded = small_bake(128);  // else its winding closes it
  flooded.sign = h6::io::SignMode::flood;
  check(soup, flooded, 400000);
  check(patch(6, 6,
              [](double s, double t) {
                return Vec3{s, t, 0.2 * s * t};
              }),
        small_bake(96), 200000);
}

TEST_CASE(
    "bake_field: as wide as the band is asked, so deep is depth the distance to the surface") {
  const Mesh mesh = turned(box({0, 0, 0}, {1, 0.8, 0.7}), 0.3, 0.5);
  const Judge judge(mesh);
  double deepest = 0;
  for (const double band : {1.0, 3.0, 5.5, 8.0}) {
    FieldBake options = small_bake(64);
    options.band_voxels = band;
    const FieldData field = must_bake(mesh, options);
    CHECK(field.band == doctest::Approx(band * field.voxel_size));
    std::size_t within = 0, wrong = 0;
    double deep = 0;
    for_nodes(field, [&](std::array<int, 3> n, double d) {
      if (n[0] % 2 != 0 || n[1] % 3 != 0) return;
      const double u = judge.distance(node_position(field, n));
      if (u > field.band) return;
      ++within;
      wrong += std::fabs(std::fabs(d) - u) > 1e-5;
      deep = std::min(deep, d);
    });
    CHECK(within > 500);
    CHECK(wrong == 0);
    CHECK(-deep > (band - 0.2) * field.voxel_size);
    CHECK(-deep > deepest);  // force goes on growing
    deepest = -deep;
  }
  for (const double band : {0.5, 8.5, 1e9, std::nan("")}) {
    FieldBake options = small_bake(64);
    options.band_voxels = band;
    CHECK_FALSE(bake_field(mesh, options, nullptr));
  }
}
