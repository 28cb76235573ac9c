// SPDX-License-Identifier: Apache-2.0
// Closed walls that are thinner than the voxels of a field.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "io/bake/bake_field.h"
#include "io/check/exact_check.h"
#include "io/field/field_file.h"
#include "io/field/unite.h"
#include "io/field/view.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

constexpr double kVoxel = 0.4e-3;

struct Made {
  FieldData field;
  FieldBakeReport report;
};
Made bake(const Mesh& mesh, double shift = 0, double tolerance = 0) {
  FieldBake options;
  if (tolerance > 0)
    options.tolerance = tolerance;
  else
    options.voxel_size = kVoxel;
  options.shift = {shift, -shift, 0.7 * shift};
  options.threads = 2;
  Made made;
  auto field = bake_field(mesh, options, &made.report);
  REQUIRE_MESSAGE(field, field.error());
  made.field = std::move(*field);
  return made;
}

// The least distance on a straight way [m].
double least_between(const FieldData& field, const Vec3& from, const Vec3& to) {
  const FieldView view(field);
  double least = 1;
  for (int i = 0; i <= 200; ++i) {
    double d = 0;
    if (view.distance(view.from_metres(from + (i / 200.0) * (to - from)), d))
      least = std::min(least, d * field.voxel_size);
  }
  return least;
}

// A cup of this wall, open above, of closed triangles; 12 mm wide and high.
Mesh cup(double wall) {
  const double r = 6e-3, in = r - wall;
  const std::vector<std::array<double, 2>> outline = {{0, 0},      {r, 0},     {r, 12e-3},
                                                      {in, 12e-3}, {in, wall}, {0, wall}};
  Mesh mesh;
  for (std::size_t i = 0; i + 1 < outline.size(); ++i)
    add(mesh, patch(48, 4, [&](double s, double t) {
          const double a = 2 * M_PI * (s < 1 ? s : 0);
          const auto& [from, to] = std::pair{outline[i], outline[i + 1]};
          const double radius = (1 - t) * from[0] + t * to[0];  // exact at both ends
          const double z = (1 - t) * from[1] + t * to[1];
          return radius < 1e-12 ? Vec3{0, 0, z}
                                : Vec3{radius * std::cos(a), radius * std::sin(a), z};
        }));
  return h6::io::weld(mesh);
}

}  // namespace

TEST_CASE("every way through a closed plate meets depth, however thin, turned and shifted it is") {
  Random random(4);
  for (const double thickness : {0.05e-3, 0.1e-3, 0.2e-3, 0.4e-3, 0.58e-3, 1e-3})
    for (int trial = 0; trial < 4; ++trial) {
      const double a = trial == 0 ? 0 : random(0, 3), b = trial == 0 ? 0 : random(0, 3);
      const Mesh plate =
          turned(box({-8e-3, -7e-3, -thickness / 2}, {8e-3, 7e-3, thickness / 2}), a, b);
      const Made made = bake(plate, random(-0.5, 0.5));
      CAPTURE(thickness);
      CAPTURE(trial);
      REQUIRE(made.report.closed);
      double shallowest = -1;
      for (int i = 0; i < 500; ++i) {
        Mesh way;
        const Vec3 p{random(-7e-3, 7e-3), random(-6e-3, 6e-3), 0};
        way.vertices = {p + Vec3{0, 0, 3e-3}, p - Vec3{0, 0, 3e-3}};
        way = turned(way, a, b);
        shallowest =
            std::max(shallowest, least_between(made.field, way.vertices[0], way.vertices[1]));
      }
      CHECK(shallowest < -0.2 * kVoxel);
      const bool grew = thickness < 1.5 * kVoxel;
      CHECK((made.report.thin.area > 0) == grew);
      CHECK((made.field.grown > 0) == grew);
      if (!grew) continue;
      CHECK(made.report.thin.area > 0.95 * 2 * 16e-3 * 14e-3);
      CHECK(made.report.thin.area < 1.02 * 2 * 16e-3 * 14e-3);
      CHECK(std::fabs(made.report.thin.thickness - thickness) < 1e-6);
      CHECK(Judge(plate).distance(made.report.thin.place) < 1e-9);
    }
}

TEST_CASE("a field with a tolerance keeps plates thinner than its finest voxel") {
  for (const double thickness : {0.02e-3, 0.1e-3, 0.2e-3}) {
    CAPTURE(thickness);
    const double voxel = h6::io::kFinest * 1e-4;
    const Made made =
        bake(turned(box({-8e-3, -7e-3, -thickness / 2}, {8e-3, 7e-3, thickness / 2}), 0.3, 0.2), 0,
             1e-4);
    CHECK(made.field.grown == doctest::Approx(0.9 * voxel));
    Mesh way;
    Random random(8);
    for (int i = 0; i < 300; ++i) {
      const Vec3 p{random(-7e-3, 7e-3), random(-6e-3, 6e-3), 0};
      way.vertices = {p + Vec3{0, 0, 2e-3}, p - Vec3{0, 0, 2e-3}};
      const Mesh at = turned(way, 0.3, 0.2);
      CHECK(least_between(made.field, at.vertices[0], at.vertices[1]) < -0.2 * voxel);
    }
  }
}

TEST_CASE("parts without thin walls grow nowhere, sharp as their edges may be") {
  const std::vector<Mesh> parts = {l_shape(4e-3), sphere({0, 0, 0}, 5e-3), torus(5e-3, 1.5e-3),
                                   box({0, 0, 0}, {9e-3, 5e-3, 1.3e-3})};
  Random random(3);
  for (const Mesh& part : parts)
    for (int trial = 0; trial < 6; ++trial) {
      const Made made = bake(turned(part, random(0, 3), random(0, 3)), random(-0.5, 0.5));
      CHECK(made.report.thin.area == 0);
      CHECK(made.field.grown == 0);
    }
}

TEST_CASE("a cup with a thin wall stays empty, and its wall stands") {
  const Made made = bake(cup(0.15e-3));
  REQUIRE(made.report.closed);
  CHECK(made.report.thin.area > 2 * M_PI * 6e-3 * 11e-3);
  const FieldView view(made.field);
  double d = 0;
  const bool sampled = view.distance(view.from_metres({0, 0, 6e-3}), d);
  CHECK((!sampled || d > 2));
  for (int i = 0; i < 60; ++i) {
    const Vec3 out{std::cos(0.1 * i), std::sin(0.1 * i), 0};
    const Vec3 up{0, 0, 1e-3 + 1.6e-4 * i};
    CHECK(least_between(made.field, up + 4e-3 * out, up + 8e-3 * out) < -0.2 * kVoxel);
    CAPTURE(i);
    CHECK(least_between(made.field, 0.08e-3 * i * out - Vec3{0, 0, 2e-3},
                        0.08e-3 * i * out + Vec3{0, 0, 2e-3}) < -0.2 * kVoxel);
  }
}

TEST_CASE("a wall that stands on a block is closed down to the block") {
  Mesh mesh = box({-6e-3, -6e-3, -5e-3}, {6e-3, 6e-3, 0});
  add(mesh, box({-0.1e-3, -5e-3, -1e-3}, {0.1e-3, 5e-3, 5e-3}));  // runs into it
  const Made made = bake(mesh, 0.3);
  REQUIRE(made.report.closed);
  for (int i = 0; i < 50; ++i) {
    const Vec3 at{0, -4.5e-3 + 0.18e-3 * i, 0.05e-3 + 0.09e-3 * i};
    CHECK(least_between(made.field, at - Vec3{3e-3, 0, 0}, at + Vec3{3e-3, 0, 0}) < -0.2 * kVoxel);
  }
  // The block's own faces stay where they are, away from the wall.
  const FieldView view(made.field);
  for (double x : {-5e-3, -3e-3, 3e-3, 5e-3}) {
    double d = 0;
    REQUIRE(view.distance(view.from_metres({x, 0, 0}), d));
    CHECK(std::fabs(d) < 1e-3);
  }
}

TEST_CASE("the check knows walls that grew, and still sees a field that is wrong") {
  const Mesh mesh = cup(0.2e-3);
  Made made = bake(mesh);
  REQUIRE(made.field.grown > 0);
  ExactCheckOptions options;
  options.points = 4000, options.far_points = 2000, options.threads = 2;
  const auto right = check_exactly(mesh, made.field, options);
  REQUIRE_MESSAGE(right, right.error());
  CHECK(right->agrees());
  CHECK(right->grown > 1000);
  CHECK(right->worst_node < 1e-3);
  for (const float by : {-0.3f, 0.3f}) {
    FieldData wrong = made.field;
    for (float& v : wrong.samples) v += by * float(kVoxel);
    const auto found = check_exactly(mesh, wrong, options);
    REQUIRE(found);
    CHECK(!found->agrees());
  }
}

TEST_CASE("files and caches keep how far walls grew") {
  const Made made = bake(box({0, 0, 0}, {8e-3, 8e-3, 0.1e-3}));
  REQUIRE(made.field.grown > 0);
  const auto file = std::filesystem::temp_directory_path() / "hapsix_thin_walls_test.vdb";
  REQUIRE(write_field(file, made.field));
  const auto read = read_field(file);
  REQUIRE_MESSAGE(read, read.error());
  CHECK(read->grown == made.field.grown);
  std::filesystem::remove(file);
}

TEST_CASE("two obstacles as one: the distance to the nearer, and never more") {
  const Mesh left = l_shape(4e-3);
  Mesh right = left;  // the other L in the same square
  for (Vec3& v : right.vertices) v = {8e-3 - v.x, 8e-3 - v.y, v.z};
  Mesh both = left;
  add(both, right);
  const FieldData a = bake(left).field, b = bake(right).field;
  REQUIRE(a.bricks == b.bricks);
  REQUIRE(norm(a.origin - b.origin) < 1e-12);
  const FieldData joined = unite(a, b, 2);
  REQUIRE(consistent(joined));
  const FieldView view(joined), first(a), second(b);
  Random random(6);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 n{double(random.below(8 * std::size_t(a.bricks[0]) - 1)),
                 double(random.below(8 * std::size_t(a.bricks[1]) - 1)),
                 double(random.below(8 * std::size_t(a.bricks[2]) - 1))};
    double d = 0, d1 = 0, d2 = 0;
    if (!view.distance(n, d)) continue;
    const bool in_first = first.distance(n, d1), in_second = second.distance(n, d2);
    if (in_first) CHECK(d <= d1 + 1e-6);
    if (in_second) CHECK(d <= d2 + 1e-6);
    // Within the band one of the two is the distance itself.
    const double band = a.band / a.voxel_size;
    if (std::fabs(d) >= band) continue;
    ++compared;
    CHECK((in_first || in_second));
    CHECK(std::min(in_first ? std::fabs(d - d1) : 1, in_second ? std::fabs(d - d2) : 1) < 1e-6);
  }
  CHECK(compared > 2000);
}
