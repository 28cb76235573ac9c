// SPDX-License-Identifier: Apache-2.0
// Gaps of rounding between vertices that were meant to be one.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;
using h6::io::FieldBakeReport;

namespace {

FieldData must_bake(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report) {
  auto field = bake_field(mesh, options, report);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}
FieldBake small_bake() {
  FieldBake options;
  options.voxels = 64;
  options.threads = 2;
  return options;
}
bool says(const FieldBakeReport& report, const std::string& words) {
  for (const std::string& w : report.warnings)
    if (w.find(words) != std::string::npos) return true;
  return false;
}
bool same_samples(const FieldData& a, const FieldData& b) {
  return a.brick_index == b.brick_index && a.samples.size() == b.samples.size() &&
         std::memcmp(a.samples.data(), b.samples.data(), a.samples.size() * sizeof(float)) == 0;
}

// A sphere by its angles, whose seam and poles only close up to rounding.
Mesh sphere_by_angles() {
  return h6::io::weld(patch(48, 24, [](double s, double t) {
    const double a = 2 * M_PI * s, b = M_PI * t;
    return Vec3{std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)};
  }));
}

// Triangles that share no vertex: each corner is off by up to `noise`.
Mesh shaken(const Mesh& mesh, double noise) {
  Random random(3);
  Mesh out;
  for (const auto& t : mesh.triangles) {
    const std::uint32_t base = std::uint32_t(out.vertices.size());
    for (const std::uint32_t v : t)
      out.vertices.push_back(mesh.vertices[v] + Vec3{random(-noise, noise), random(-noise, noise),
                                                     random(-noise, noise)});
    out.triangles.push_back({base, base + 1, base + 2});
  }
  return out;
}

// The samples against the shape without noise.
void check_solid(const FieldData& field, const Mesh& mesh, double slack) {
  const Judge judge(mesh);
  Random random(5);
  std::size_t wrong = 0, count = 0, inside = 0;
  double worst = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    if (count++ % 7 != 0) return;
    const Vec3 p = node_position(field, n);
    const double u = judge.distance(p);
    inside += d < 0;
    if (u < field.band) worst = std::max(worst, std::fabs(std::fabs(d) - u));
    if (u > slack) wrong += (d < 0) != judge.inside_by_parity(p, random);
  });
  CHECK(inside > 500);
  CHECK(wrong == 0);
  CHECK(worst < slack);
}

}  // namespace

TEST_CASE("weld: a sphere whose seam misses by the sine of two pi is closed, and that is said") {
  const Mesh sphere = sphere_by_angles();
  REQUIRE_FALSE(h6::io::audit(sphere).closed);
  FieldBakeReport report;
  const FieldData field = must_bake(sphere, small_bake(), &report);
  CHECK(report.closed);
  CHECK(field.sign_mode == "closed");
  CHECK(field.offset == 0);
  CHECK(report.welded > 20);
  CHECK(report.weld_widest > 0);
  CHECK(report.weld_widest < 1e-12);
  CHECK(says(report, "welded"));
  check_solid(field, sphere, 1e-3 * field.voxel_size);
  FieldBake exact = small_bake();
  exact.weld = 0;
  CHECK(must_bake(sphere, exact, &report).sign_mode == "flood");
  CHECK_FALSE(report.closed);
  CHECK(report.welded == 0);
}

TEST_CASE("weld: triangles that share no vertex become a solid, up to the tolerance and no wider") {
  const Mesh solid = turned(l_shape(1.0), 0.3, 0.5);
  const double voxel = 2.0 / 48;
  FieldBake options = small_bake();
  options.voxel_size = voxel;
  for (const double noise : {1e-9, 1e-4 * voxel, 2e-3 * voxel}) {
    FieldBakeReport report;
    const FieldData field = must_bake(shaken(solid, noise), options, &report);
    CAPTURE(noise);
    CHECK(report.closed);
    CHECK(report.weld_widest <= 0.01 * voxel);
    check_solid(field, solid, 2 * std::sqrt(3) * noise + 1e-3 * voxel);
  }
  FieldBakeReport report;
  must_bake(shaken(solid, 0.02 * voxel), options, &report);
  CHECK_FALSE(report.closed);
  CHECK(report.welded == 0);
  options.weld = 0.2;
  must_bake(shaken(solid, 0.02 * voxel), options, &report);
  CHECK(report.closed);
  // The same as a length.
  options.weld = 0.01;
  options.weld_length = 0.2 * voxel;
  must_bake(shaken(solid, 0.02 * voxel), options, &report);
  CHECK(report.closed);
  options.weld_length = 1.1 * voxel;
  const auto wide = bake_field(shaken(solid, 0.02 * voxel), options, nullptr);
  REQUIRE_FALSE(wide);
  CHECK(wide.error().find("within a voxel") != std::string::npos);
}

TEST_CASE("weld: closed meshes with vertices closer than the tolerance keep every bit") {
  // Twins of one box touch the next one: no vertex of a closed mesh moves.
  Mesh mesh = box({0, 0, 0}, {1, 0.5, 0.5}, 4);
  add(mesh, box({0, 0, 0.5 + 1e-5}, {1, 0.5, 1}, 4));
  FieldBake exact = small_bake();
  exact.weld = 0;
  FieldBakeReport report;
  CHECK(same_samples(must_bake(mesh, small_bake(), &report), must_bake(mesh, exact, nullptr)));
  CHECK(report.welded == 0);
}

TEST_CASE("weld: a soup that no weld closes keeps every bit, and hears what a weld would leave") {
  Mesh mesh = shaken(sphere({0, 0, 0}, 1, 8), 1e-9);
  mesh.triangles.pop_back();
  FieldBake exact = small_bake();
  exact.weld = 0;
  FieldBakeReport report;
  CHECK(same_samples(must_bake(mesh, small_bake(), &report), must_bake(mesh, exact, nullptr)));
  CHECK_FALSE(report.closed);
  CHECK(report.welded == 0);
  CHECK(says(report, "would leave 3"));
}

TEST_CASE("weld: a ribbon narrower than the tolerance beside a closed solid does not vanish") {
  Mesh mesh = box({0, 0, 0}, {1, 0.5, 0.5}, 4);
  add(mesh, patch(20, 1, [](double s, double t) { return Vec3{s, 0.7 + 1e-5 * t, 0.2}; }));
  FieldBakeReport report;
  const FieldData field = must_bake(mesh, small_bake(), &report);
  CHECK(report.welded == 0);
  double value = 1;
  REQUIRE(interpolate(field, {0.5, 0.7, 0.2}, value));
  CHECK(value < 0);
}

TEST_CASE("weld: a tolerance out of range is one sentence") {
  for (const double weld : {-0.1, 1.5, double(NAN)}) {
    FieldBake options = small_bake();
    options.weld = weld;
    const auto field = bake_field(sphere({0, 0, 0}, 1), options, nullptr);
    REQUIRE_FALSE(field);
    CHECK(field.error().find("weld") != std::string::npos);
  }
}
