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

namespace {

constexpr int kCells = 16, kMiddle = 8;
constexpr double kCell = 5 * kVoxel;

// A cube of kCells^3 cells that lacks the octant of high x, y and z, with a crack: a cell's width
// of both walls is missing along the edge that leaves the concave corner in direction z.
Mesh cracked_corner() {
  const auto solid = [](const std::array<int, 3>& c) {
    const bool in = std::all_of(c.begin(), c.end(), [](int k) { return k >= 0 && k < kCells; });
    return in && std::any_of(c.begin(), c.end(), [](int k) { return k < kMiddle; });
  };
  Mesh mesh;
  const auto wall = [&](const std::array<int, 3>& c, std::size_t axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (axis < 2 && c[0] == kMiddle && c[1] == kMiddle && c[2] >= kMiddle) return;
    const auto first = std::uint32_t(mesh.vertices.size());
    for (const auto [s, t] :
         {std::array{0, 0}, std::array{1, 0}, std::array{1, 1}, std::array{0, 1}}) {
      std::array<double, 3> p = {double(c[0]), double(c[1]), double(c[2])};
      p[u] += s, p[v] += t;
      mesh.vertices.push_back(kCell * Vec3{p[0], p[1], p[2]});
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  };
  for (int z = 0; z <= kCells; ++z)
    for (int y = 0; y <= kCells; ++y)
      for (int x = 0; x <= kCells; ++x)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          std::array<int, 3> before = {x, y, z};
          --before[axis];
          if (solid({x, y, z}) != solid(before)) wall({x, y, z}, axis);
        }
  return h6::io::weld(mesh);
}

struct Compared {
  std::size_t nodes = 0;
  double worst = 0;  // [m]
};
// Compares the samples in and around a cube from the origin that two fields with the same nodes,
// but other bricks, have within the band.
Compared compare(const FieldData& a, const FieldData& b, double side) {
  const Vec3 moved = (1 / kVoxel) * (a.origin - b.origin);
  const double low = -3 * kVoxel, high = side + 3 * kVoxel;
  Compared out;
  for_nodes(a, [&](std::array<int, 3> n, double d) {
    if (std::fabs(d) > a.band) return;
    if (!within(node_position(a, n), {low, low, low}, {high, high, high})) return;
    for (std::size_t k = 0; k < 3; ++k) n[k] += int(std::lround(component(moved, int(k))));
    const float* other = node_sample(b, n);
    out.worst = std::max(out.worst, other == nullptr ? 1 : std::fabs(d - double(*other)));
    ++out.nodes;
  });
  return out;
}

}  // namespace

TEST_CASE("seal: a crack in a concave corner is closed alike wherever bricks end") {
  // Chains of nodes lead from where a ball of the seal's width can be to the corner, 12 steps on.
  const Mesh corner = cracked_corner();
  const double side = kCells * kCell, room = 36 * kVoxel, speck = kVoxel;
  FieldData first;
  FieldBakeReport alike;
  for (int by = 0; by < 8; ++by) {
    CAPTURE(by);
    // Specks far off at both ends move the middle of the grid, and so its bricks.
    Mesh mesh = corner;
    const double low = -room - by * kVoxel, high = side + room + (8 - by) * kVoxel;
    add(mesh, box({low - speck, low - speck, low - speck}, {low, low, low}, 1));
    add(mesh, box({high, high, high}, {high + speck, high + speck, high + speck}, 1));
    FieldBakeReport report;
    FieldData field = must_bake(mesh, options_with(24 * kVoxel), &report);
    CHECK(inside(field, {side / 4, side / 4, side / 4}));
    if (by == 0) {
      CHECK(report.sealed_area > 0);
      first = std::move(field), alike = std::move(report);
      continue;
    }
    CHECK(report.sealed.size() == alike.sealed.size());
    CHECK(report.sealed_area == doctest::Approx(alike.sealed_area).epsilon(1e-9));
    const auto [compared, worst] = compare(first, field, side);
    CHECK(compared > 50000);
    CHECK(worst < 1e-4 * kVoxel);
  }
}
