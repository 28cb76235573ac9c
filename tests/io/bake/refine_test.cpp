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
using h6::io::FieldBakeReport;
using h6::io::FieldView;
using h6::io::SignMode;

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

// The surface of the solid cells between planes x, y and z.
template <class Solid>
Mesh solid_cells(const std::array<std::vector<double>, 3>& planes, Solid&& solid) {
  int cells[3];
  for (std::size_t k = 0; k < 3; ++k) cells[k] = int(planes[k].size()) - 1;
  const auto in = [&](std::array<int, 3> c) {
    for (std::size_t k = 0; k < 3; ++k)
      if (c[k] < 0 || c[k] >= cells[k]) return false;
    return bool(solid(c[0], c[1], c[2]));
  };
  Mesh mesh;
  for (int i = 0; i < cells[0] * cells[1] * cells[2]; ++i) {
    const std::array<int, 3> c{i % cells[0], i / cells[0] % cells[1], i / cells[0] / cells[1]};
    for (std::size_t axis = 0; axis < 3 && in(c); ++axis)
      for (const int step : {-1, 1}) {
        std::array<int, 3> next = c;
        next[axis] += step;
        if (in(next)) continue;
        const auto base = std::uint32_t(mesh.vertices.size());
        for (const auto& [u, v] : {std::array{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
          std::array<int, 3> at = c;
          at[axis] += step > 0;
          at[(axis + 1) % 3] += u;
          at[(axis + 2) % 3] += v;
          mesh.vertices.push_back({planes[0][std::size_t(at[0])], planes[1][std::size_t(at[1])],
                                   planes[2][std::size_t(at[2])]});
        }
        mesh.triangles.push_back({base, base + 1, base + 2});
        mesh.triangles.push_back({base, base + 2, base + 3});
      }
  }
  return h6::io::weld(mesh);
}

void check_errors(const Mesh& mesh, double tolerance, Vec3 shift) {
  CAPTURE(shift.x);
  const FieldData field = bake_to(mesh, tolerance, shift);
  CHECK(consistent(field));
  const Errors e = errors_of(field, mesh, 20000);
  CHECK(e.worst <= tolerance);
  CHECK(e.missing == 0);
  CHECK(e.wrong_side == 0);
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

TEST_CASE("what is smaller than a coarse voxel is in a field to a tolerance, wherever nodes lie") {
  // Posts and holes on a plate, up to three tolerances wide and high.
  const double t = 2e-4;
  std::array<std::vector<double>, 3> planes;
  for (std::size_t k = 0; k < 2; ++k)
    for (int i = 0; i <= 4; ++i) {
      planes[k].push_back(37 * t * i);
      planes[k].push_back((37 * i + 2.5 + 0.5 * i) * t);
    }
  planes[2] = {0, 12 * t, 14 * t, 16 * t};
  const Mesh mesh = solid_cells(planes, [](int x, int y, int z) {
    if (x % 2 == 1 || y % 2 == 1) return z < 2;
    return z < ((x + y) % 4 == 0 ? 3 : 1);
  });
  for (const double by : {0.0, 0.17, 0.31, 0.46}) check_errors(mesh, t, {by, -by, by / 2});
  check_errors(turned(mesh, 0.4, 0.7), t, {});
}

TEST_CASE(
    "a hollow behind a neck that only fine voxels pass is outside of a field to a tolerance") {
  const double t = 4e-4;
  std::array<std::vector<double>, 3> planes;
  for (std::size_t k = 0; k < 3; ++k) planes[k] = {0, 15 * t, 40 * t, 42.2 * t, 70 * t, 85 * t};
  const Mesh mesh = solid_cells(planes, [](int x, int y, int z) {
    const bool hollow = x > 0 && x < 4 && y > 0 && y < 4 && z > 0 && z < 4;
    return !hollow && !(x == 2 && y == 2 && z == 4);
  });
  for (const double by : {0.0, 0.2, 0.4}) check_errors(mesh, t, {by, by / 2, -by});
  check_errors(turned(mesh, 0.3, 0.2), t, {});
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

TEST_CASE("a hole that winding closes leaks with neither a tolerance nor a voxel size") {
  Mesh mesh = box({0, 0, 0}, {0.03, 0.02, 0.02}, 8);
  mesh.triangles.pop_back();
  const auto leaks = [&](double tolerance, SignMode sign) {
    FieldBake options;
    (tolerance > 0 ? options.tolerance : options.voxel_size) = 4e-4;
    options.sign = sign;
    if (sign == SignMode::flood) options.offset = 0;
    FieldBakeReport report;
    REQUIRE(bake_field(mesh, options, &report));
    return std::any_of(report.warnings.begin(), report.warnings.end(), [](const std::string& w) {
      return w.find("leaks in") != std::string::npos;
    });
  };
  for (const double tolerance : {0.0, 4e-4}) {
    CHECK_FALSE(leaks(tolerance, SignMode::winding));
    CHECK(leaks(tolerance, SignMode::flood));
  }
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
