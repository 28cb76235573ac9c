// SPDX-License-Identifier: Apache-2.0
// Fields baked to a tolerance: the error between nodes, continuity, memory.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "io/bake/bake_field.h"
#include "io/field/view.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;
using h6::io::FieldView;

namespace {

FieldData bake_to(const Mesh& mesh, double tolerance, Vec3 shift = {}) {
  FieldBake options;
  options.tolerance = tolerance;
  options.shift = shift;
  options.threads = 2;
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

struct Errors {
  std::size_t places = 0, missing = 0, wrong_side = 0;
  double worst = 0;  // [m]
};
// Random places near the triangles, nearer to them than the band.
Errors errors_of(const FieldData& field, const Mesh& mesh, std::size_t places) {
  const Judge judge(mesh);
  const FieldView view(field);
  Random random(7);
  Errors e;
  while (e.places < places) {
    const auto& t = mesh.triangles[random.below(mesh.triangles.size())];
    double s = random(0, 1), r = random(0, 1);
    if (s + r > 1) s = 1 - s, r = 1 - r;
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const double reach = 9 * field.tolerance;
    const Vec3 p = a + s * (b - a) + r * (c - a) +
                   Vec3{random(-reach, reach), random(-reach, reach), random(-reach, reach)};
    const double d = judge.distance(p);
    if (d >= reach) continue;
    ++e.places;
    double found = 0;
    if (!view.distance(view.from_metres(p), found)) {
      ++e.missing;
      continue;
    }
    found *= field.voxel_size;
    const double truth = judge.inside_by_parity(p, random) ? -d : d;
    e.wrong_side += d > field.tolerance && (found < 0) != (truth < 0);
    e.worst = std::max(e.worst, std::fabs(found - truth));
  }
  return e;
}

// In the engine, where a sample takes two bytes.
std::size_t bytes_of(const FieldData& f) {
  return 1472 * f.brick_count() + 1024 * f.fine_index.size() / 512 + 64 * f.half_count() +
         256 * f.quarter_count();
}

}  // namespace

TEST_CASE("a field baked to a tolerance keeps it everywhere in its band, and is smaller") {
  const Mesh block = turned(box({0, 0, 0}, {0.1, 0.06, 0.04}), 0.4, 0.7);
  struct Case {
    const char* name;
    Mesh mesh;
    double tolerance;
    double smaller;  // than uniform voxels as fine as its finest, at least
  };
  const Case cases[] = {{"block", block, 2e-4, 6},
                        {"block, coarse", block, 5e-4, 3},
                        {"block, fine", block, 1e-4, 9},
                        {"torus", torus(0.03, 0.01, 96, 48), 1e-4, 15},
                        {"L", turned(l_shape(0.02), 0.2, 1.1), 1e-4, 5},
                        {"plate", turned(box({0, 0, 0}, {0.05, 0.04, 2e-4}), 0.3, 0.2), 4e-5, 2}};
  for (const Case& c : cases) {
    CAPTURE(std::string(c.name));
    const FieldData field = bake_to(c.mesh, c.tolerance);
    CHECK(consistent(field));
    const Errors e = errors_of(field, c.mesh, 20000);
    CHECK(e.worst <= c.tolerance);
    CHECK(e.missing == 0);
    CHECK(e.wrong_side == 0);
    FieldBake uniform;
    uniform.voxel_size = h6::io::kFinest * c.tolerance;
    const auto whole = bake_field(c.mesh, uniform, nullptr);
    REQUIRE(whole);
    CHECK(double(bytes_of(*whole)) > c.smaller * double(bytes_of(field)));
  }
}

TEST_CASE("a field baked to a tolerance is continuous across its cells") {
  const FieldData field = bake_to(turned(l_shape(0.02), 0.2, 1.1), 2e-4);
  REQUIRE(field.half_count() > 0);
  REQUIRE(field.quarter_count() > 0);
  const FieldView view(field);
  Random random(3);
  std::size_t tried = 0;
  double worst = 0;
  while (tried < 200000) {
    // A place on a face between two cells, seen from both sides.
    double g[3];
    const std::size_t axis = random.below(3);
    for (std::size_t k = 0; k < 3; ++k) g[k] = random(0, 8.0 * field.bricks[k] - 1);
    g[axis] = std::floor(g[axis]);
    double before = 0, after = 0;
    const Vec3 step{axis == 0 ? 1e-9 : 0, axis == 1 ? 1e-9 : 0, axis == 2 ? 1e-9 : 0};
    const Vec3 p{g[0], g[1], g[2]};
    if (!view.distance(p - step, before) || !view.distance(p + step, after)) continue;
    ++tried;
    worst = std::max(worst, std::fabs(before - after));
  }
  CHECK(worst < 1e-5);  // voxel; samples are floats
}

TEST_CASE("a field baked to a tolerance is the same on any number of threads") {
  FieldBake options;
  options.tolerance = 3e-4;
  const Mesh mesh = turned(l_shape(0.02), 0.2, 1.1);
  options.threads = 1;
  const auto one = bake_field(mesh, options, nullptr);
  options.threads = 3;
  const auto three = bake_field(mesh, options, nullptr);
  REQUIRE(one);
  REQUIRE(three);
  const auto same = [](const auto& u, const auto& v) {
    return u.size() == v.size() && std::memcmp(u.data(), v.data(), u.size() * sizeof u[0]) == 0;
  };
  CHECK(same(one->samples, three->samples));
  CHECK(same(one->fine_index, three->fine_index));
  CHECK(same(one->halves, three->halves));
  CHECK(same(one->quarters, three->quarters));
}

TEST_CASE("a tolerance that no grid keeps, or beside a voxel size, is refused in one sentence") {
  const Mesh mesh = box({0, 0, 0}, {1, 0.1, 0.1});
  FieldBake options;
  for (const double bad : {-1.0, double(NAN), double(INFINITY)}) {
    options.tolerance = bad;
    CHECK_FALSE(bake_field(mesh, options, nullptr));
  }
  options.tolerance = 1e-5;
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_FALSE(field);
  CHECK(field.error().find("choose at least") != std::string::npos);
  options.tolerance = 1e-3;
  options.voxel_size = 1e-3;
  field = bake_field(mesh, options, nullptr);
  REQUIRE_FALSE(field);
  CHECK(field.error().find("not both") != std::string::npos);
}
