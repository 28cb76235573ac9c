// SPDX-License-Identifier: Apache-2.0
// Holes of known width: a part drains through them without --seal and holds with it, and nothing
// else changes.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;
using h6::io::FieldBakeReport;

namespace {

constexpr double kVoxel = 1.0 / 48;

FieldBake options_with(double seal) {
  FieldBake options;
  options.voxel_size = kVoxel;
  options.threads = 2;
  options.seal = seal;
  return options;
}

FieldData must_bake(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report = nullptr) {
  auto field = bake_field(mesh, options, report);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

// A unit box of n x n squares a side, without those whose middle `drop` selects.
template <class Drop>
Mesh box_without(int n, Drop&& drop, Vec3 size = {1, 1, 1}) {
  Mesh mesh = box({0, 0, 0}, size, n);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    const Vec3 m = (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
    return drop(m);
  });
  return mesh;
}

// A square hole of `cells` x `cells` of 24, an even number, in the middle of the top.
Mesh holed_box(int cells, Vec3 size = {1, 1, 1}) {
  const double half = 0.5 * cells / 24;
  return box_without(
      24,
      [&](Vec3 m) {
        return m.z > size.z - 1e-9 && std::fabs(m.x / size.x - 0.5) < half &&
               std::fabs(m.y / size.y - 0.5) < half;
      },
      size);
}

bool within(Vec3 p, Vec3 low, Vec3 high) {
  return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y && p.z < high.z;
}

// The side of a node, from its brick or from the far grid.
bool inside(const FieldData& f, Vec3 p) {
  const Vec3 g = (1 / f.voxel_size) * (p - f.origin);
  if (const float* d =
          node_sample(f, {int(std::lround(g.x)), int(std::lround(g.y)), int(std::lround(g.z))}))
    return *d < 0;
  const auto at = [](double v) { return std::size_t(std::lround(v / 8)); };
  return f.far_grid[(at(g.z) * std::size_t(f.bricks[1] + 1) + at(g.y)) *
                        std::size_t(f.bricks[0] + 1) +
                    at(g.x)] < 0;
}

// Nodes on the wrong side of a solid box, away from `hole` and beyond the offset.
std::size_t wrong_nodes(const FieldData& f, Vec3 size, Vec3 hole, double away) {
  std::size_t wrong = 0;
  const double skin = f.offset + 0.01 * kVoxel;
  for_nodes(f, [&](std::array<int, 3> n, double d) {
    const Vec3 p = node_position(f, n);
    if (norm(p - hole) < away) return;
    const bool in = within(p, {0, 0, 0}, size);
    const bool out = !within(p, {-skin, -skin, -skin}, size + Vec3{skin, skin, skin});
    wrong += (in && d >= 0) || (out && d < 0);
  });
  return wrong;
}

}  // namespace

TEST_CASE("seal: a box with a hole drains without it and holds with it") {
  for (const int cells : {2, 4, 6}) {
    const double width = cells / 24.0;  // 4, 8, 12 voxels
    INFO("hole of " << width / kVoxel << " voxels");
    const Mesh mesh = holed_box(cells);
    const Vec3 middle{0.5, 0.5, 0.5}, hole{0.5, 0.5, 1};
    CHECK_FALSE(inside(must_bake(mesh, options_with(0)), middle));
    CHECK_FALSE(inside(must_bake(mesh, options_with(0.5 * width)), middle));
    FieldBakeReport report;
    // A ball as wide as the hole's diagonal cannot pass.
    const FieldData held = must_bake(mesh, options_with(1.3 * width), &report);
    CHECK(inside(held, middle));
    CHECK(wrong_nodes(held, {1, 1, 1}, hole, 0.8 * width) == 0);
    const double open = width - 2 * held.offset;  // the offset closes the rest
    CHECK(report.sealed_area > 0.8 * open * open);
    CHECK(report.sealed_area < 3 * width * width);
    CHECK(std::any_of(report.warnings.begin(), report.warnings.end(), [](const std::string& w) {
      return w.find("closed, ") != std::string::npos;
    }));
  }
}

TEST_CASE("seal: a plate thinner than the hole is wide holds too") {
  const Vec3 size{1, 1, 0.125};  // 6 voxels thick, a hole of 8
  const Mesh mesh = holed_box(4, size);
  const double width = 4.0 / 24;
  CHECK_FALSE(inside(must_bake(mesh, options_with(0)), {0.2, 0.2, 0.0625}));
  const FieldData held = must_bake(mesh, options_with(1.3 * width));
  CHECK(inside(held, {0.2, 0.2, 0.0625}));
  CHECK(wrong_nodes(held, size, {0.5, 0.5, size.z}, 1.2 * width) == 0);
}

TEST_CASE("seal: single missing triangles at edges and corners are closed") {
  std::size_t count = 0, gone = 0;
  const Mesh mesh = box_without(24, [&](Vec3) { return ++count % 97 == 0 && ++gone > 0; });
  CHECK(gone > 50);
  const FieldData held = must_bake(mesh, options_with(4 * kVoxel));
  CHECK(wrong_nodes(held, {1, 1, 1}, {9, 9, 9}, 0) < 20 * gone);  // shallow dents at most
  std::size_t deep = 0;
  for_nodes(held, [&](std::array<int, 3> n, double d) {
    const double in = 2.5 * kVoxel;
    deep += d >= 0 && within(node_position(held, n), {in, in, in}, {1 - in, 1 - in, 1 - in});
  });
  CHECK(deep == 0);
}

TEST_CASE("seal: a mesh without holes is unchanged, bit for bit, concave corners included") {
  const auto same = [](const auto& a, const auto& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
  };
  FieldBake plain = options_with(0), sealed = options_with(8 * kVoxel);
  plain.sign = sealed.sign = h6::io::SignMode::flood;  // else sealing ignores a closed mesh
  Mesh room = box({0, 0, 0}, {1, 1, 1}, 4);            // a pit: five concave corners and edges
  std::erase_if(room.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return room.vertices[v].z > 1 - 1e-9; });
  });
  for (const Mesh& mesh :
       {l_shape(1.0), turned(l_shape(1.0), 0.4, 0.3), turned(room, 0.3, 0.2), torus(1.0, 0.4)}) {
    FieldBakeReport report;
    const FieldData a = must_bake(mesh, plain), b = must_bake(mesh, sealed, &report);
    CHECK(report.sealed_area == 0);
    CHECK(same(a.brick_index, b.brick_index));
    CHECK(same(a.samples, b.samples));
    CHECK(same(a.far_grid, b.far_grid));
  }
}

TEST_CASE("seal: on a closed mesh there is nothing to do, and that is said") {
  FieldBakeReport report;
  const FieldData a = must_bake(torus(1.0, 0.4), options_with(0)),
                  b = must_bake(torus(1.0, 0.4), options_with(8 * kVoxel), &report);
  CHECK(b.sign_mode == "closed");
  REQUIRE(a.samples.size() == b.samples.size());
  CHECK(std::memcmp(a.samples.data(), b.samples.data(), 4 * a.samples.size()) == 0);
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].find("no hole") != std::string::npos);
}

TEST_CASE("seal: any number of threads gives the same field") {
  const Mesh mesh = turned(holed_box(2), 0.3, 0.4);
  FieldBake options = options_with(9 * kVoxel);
  const FieldData two = must_bake(mesh, options);
  options.threads = 1;
  const FieldData one = must_bake(mesh, options);
  REQUIRE(one.samples.size() == two.samples.size());
  CHECK(std::memcmp(one.samples.data(), two.samples.data(), 4 * one.samples.size()) == 0);
  CHECK(inside(one, mesh.vertices[0]) == inside(two, mesh.vertices[0]));
}

TEST_CASE("seal: widths that cannot be had are one sentence") {
  const auto fails = [](const FieldBake& options, const std::string& about) {
    const auto field = bake_field(holed_box(2), options, nullptr);
    REQUIRE_FALSE(field);
    INFO(field.error());
    CHECK(field.error().find(about) != std::string::npos);
  };
  fails(options_with(-1), "a length");
  fails(options_with(40 * kVoxel), "choose larger voxels");
  FieldBake options = options_with(4 * kVoxel);
  options.offset = 0.1 * kVoxel;
  fails(options, "offset of at least");
}
