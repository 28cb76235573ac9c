// SPDX-License-Identifier: Apache-2.0
// Each brick is named after the nearest triangle of the given mesh, and after its part.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "io/bake/bake_field.h"
#include "kernels/bake/triangle_distance.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

double distance_to(const Mesh& mesh, std::size_t t, Vec3 p) {
  const double at[3] = {p.x, p.y, p.z};
  double corner[3][3];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& v = mesh.vertices[mesh.triangles[t][i]];
    corner[i][0] = v.x, corner[i][1] = v.y, corner[i][2] = v.z;
  }
  return std::sqrt(h6::kernels::point_triangle_squared(at, corner[0], corner[1], corner[2]));
}

Vec3 middle_of(const FieldData& f, std::size_t cell) {
  const std::size_t x = std::size_t(f.bricks[0]), y = std::size_t(f.bricks[1]);
  return f.origin + f.voxel_size * Vec3{8.0 * double(cell % x) + 3.5,
                                        8.0 * double(cell / x % y) + 3.5,
                                        8.0 * double(cell / x / y) + 3.5};
}

// Counts bricks whose triangle is not the nearest one, and bricks without a triangle.
struct Judged {
  std::size_t bricks = 0, near = 0, wrong = 0, nameless = 0, wrong_part = 0;
};
Judged judge(const FieldData& f, const Mesh& mesh) {
  Judged j;
  REQUIRE(f.triangle.size() == f.brick_count());
  for (std::size_t c = 0; c < f.brick_index.size(); ++c) {
    if (f.brick_index[c] < 0) continue;
    const std::size_t r = std::size_t(f.brick_index[c]);
    ++j.bricks;
    if (f.triangle[r] < 0) {
      ++j.nameless;
      continue;
    }
    REQUIRE(std::size_t(f.triangle[r]) < mesh.triangles.size());
    const Vec3 p = middle_of(f, c);
    double least = 1e300;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      least = std::min(least, distance_to(mesh, t, p));
    // At the edge of the band the bake does not see every triangle.
    const double slack = least < 8 * f.voxel_size ? 1e-4 : 1;
    j.wrong += distance_to(mesh, std::size_t(f.triangle[r]), p) > least + slack * f.voxel_size;
    j.near += least < 8 * f.voxel_size;
    if (!f.part.empty()) j.wrong_part += f.part[r] != mesh.part[std::size_t(f.triangle[r])];
  }
  return j;
}

FieldData must_bake(const Mesh& mesh, const FieldBake& options) {
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

FieldBake with_voxels(int voxels) {
  FieldBake options;
  options.voxels = voxels;
  return options;
}

}  // namespace

TEST_CASE("each brick is named after the nearest triangle, with parts and without") {
  Mesh mesh = turned(torus(0.03, 0.012, 40, 20), 0.5, 0.2);
  const Judged plain = judge(must_bake(mesh, with_voxels(96)), mesh);
  CHECK(plain.bricks > 300);
  CHECK(plain.near > 0.7 * double(plain.bricks));
  CHECK(plain.wrong == 0);
  CHECK(plain.nameless == 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) mesh.part.push_back(int(t % 3));
  mesh.part_names = {"a", "b", "c"};
  const Judged parts = judge(must_bake(mesh, with_voxels(96)), mesh);
  CHECK(parts.wrong == 0);
  CHECK(parts.wrong_part == 0);
}

TEST_CASE("triangles keep the numbers they have in the mesh, whatever the bake drops") {
  // Flat triangles and copies come first and in between.
  const Mesh sound = sphere({0.01, 0, 0}, 0.02, 6);
  Mesh mesh = sound;
  mesh.triangles.clear();
  for (const auto& t : sound.triangles) {
    mesh.triangles.push_back({t[0], t[0], t[1]});
    mesh.triangles.push_back(t);
    mesh.triangles.push_back({t[1], t[2], t[0]});
  }
  const FieldData field = must_bake(mesh, with_voxels(64));
  const Judged j = judge(field, mesh);
  CHECK(j.bricks > 100);
  CHECK(j.wrong == 0);
  CHECK(j.nameless == 0);
  std::size_t flat = 0, copies = 0;
  for (const std::int32_t t : field.triangle) flat += t % 3 == 0, copies += t % 3 == 2;
  CHECK(flat == 0);
  CHECK(copies == 0);  // the first of equals counts
}

TEST_CASE("any number of threads names the same triangles") {
  FieldBake options = with_voxels(96);
  const Mesh mesh = turned(l_shape(0.02), 0.4, 0.3);
  options.threads = 1;
  const FieldData one = must_bake(mesh, options);
  options.threads = 3;
  CHECK(one.triangle == must_bake(mesh, options).triangle);
}

TEST_CASE("bricks next to a sealed hole are named after no triangle") {
  // A box whose lid has a hole of a quarter of its width.
  Mesh mesh = box({0, 0, 0}, {1, 1, 1}, 24);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    const Vec3 m = (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
    return m.z > 1 - 1e-9 && std::fabs(m.x - 0.5) < 0.126 && std::fabs(m.y - 0.5) < 0.126;
  });
  FieldBake options;
  options.voxel_size = 1.0 / 96;
  options.seal = 0.3;
  const FieldData field = must_bake(mesh, options);
  std::size_t nameless = 0, elsewhere = 0;
  for (std::size_t c = 0; c < field.brick_index.size(); ++c) {
    if (field.brick_index[c] < 0 || field.triangle[std::size_t(field.brick_index[c])] >= 0)
      continue;
    ++nameless;
    const Vec3 p = middle_of(field, c);
    elsewhere += std::fabs(p.x - 0.5) > 0.2 || std::fabs(p.y - 0.5) > 0.2 || p.z < 0.7;
  }
  CHECK(nameless >= 4);
  CHECK(elsewhere == 0);
}
