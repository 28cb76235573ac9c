// SPDX-License-Identifier: Apache-2.0
// Sides of nodes that are cut off from all their neighbours: in crevices and in thin solids.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;

namespace {

// A closed tube with flat ends.
Mesh rod(double length, double radius) {
  const int around = 10;
  const auto at = [&](double s, double t) {
    const double a = 2 * M_PI * (t < 1 ? t : 0);
    return Vec3{length * (s - 0.5), radius * std::cos(a), radius * std::sin(a)};
  };
  Mesh mesh = patch(6, around, at);
  for (const double end : {0.0, 1.0})
    add(mesh, patch(1, around, [&](double s, double t) {
          const Vec3 rim = at(end, t);
          return Vec3{rim.x, s * rim.y, s * rim.z};
        }));
  return h6::io::weld(mesh);
}

// Rods of 0.8 to 4 voxels, many of which overlap. `aligned`: along the axes but for rounding, so
// that facets lean by next to nothing.
std::vector<Mesh> pile_of_rods(double voxel, std::uint64_t seed, bool aligned) {
  Random random(seed);
  std::vector<Mesh> rods;
  const auto angle = [&] {
    const double a = random(0, 6);
    return aligned ? M_PI / 2 * std::round(a) : a;
  };
  for (int i = 0; i < 60; ++i) {
    const Mesh one = rod(1.2, voxel * random(0.4, 2));
    const double a = angle(), b = angle();
    rods.push_back(
        shifted(turned(one, a, b), {random(-0.3, 0.3), random(-0.3, 0.3), random(-0.3, 0.3)}));
  }
  return rods;
}

Vec3 direction(Random& random) {
  Vec3 d;
  do d = {random(-1, 1), random(-1, 1), random(-1, 1)};
  while (norm(d) > 1 || norm(d) < 0.1);
  return (1 / norm(d)) * d;
}

}  // namespace

TEST_CASE(
    "pockets: where thin solids overlap, no node in one is outside, and no node with free view is "
    "inside") {
  for (const bool aligned : {false, true}) {
    CAPTURE(aligned);
    FieldBake options;
    options.grow_thin = false;
    options.voxel_size = 1.0 / 64;
    options.threads = 2;
    const std::vector<Mesh> rods = pile_of_rods(options.voxel_size, 1, aligned);
    Mesh all;
    for (const Mesh& mesh : rods) add(all, mesh);
    std::vector<Judge> judges;
    for (const Mesh& mesh : rods) judges.emplace_back(mesh);
    const Judge judge(all);
    const auto field = bake_field(all, options, nullptr);
    REQUIRE(field);
    CHECK(field->sign_mode == "closed");
    Random random(9);
    std::size_t count = 0;
    std::size_t leaked = 0, inside = 0, twice = 0, shut = 0, outside = 0;
    for_nodes(*field, [&](std::array<int, 3> n, double d) {
      const Vec3 p = node_position(*field, n);
      if (std::fabs(d) > options.voxel_size || std::fabs(d) < 1e-4 * options.voxel_size) return;
      if (d > 0 && count++ % 4 != 0) return;
      std::size_t in = 0;
      for (const Judge& one : judges) in += one.inside_by_parity(p, random);
      inside += in > 0;
      twice += in > 1;
      leaked += in > 0 && d > 0;
      if (in > 0 || d > 0) {
        outside += in == 0;
        return;
      }
      for (int look = 0; look < 100; ++look)
        if (judge.hits(p, direction(random)) == 0) {
          ++shut;
          break;
        }
    });
    CHECK(inside > 2000);
    CHECK(twice > 200);
    CHECK(outside > 3000);
    CHECK(leaked == 0);
    CHECK(shut == 0);
  }
}

namespace {

// A block with a slot that goes straight down from its top and then bends along +x, in voxels: all
// its gaps are narrower than one. Nodes lie at whole numbers, moved by `node`. With a lid the slot
// is a closed hollow.
Mesh bent_slot(const Vec3& node, bool lid) {
  constexpr double kTop = 0.5;
  const auto part = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    const auto within = [](double v) { return std::clamp(v, -6.0, 6.0); };
    return box({within(x0 + node.x), within(y0), within(z0 + node.z)},
               {within(x1 + node.x), within(y1), within(z1 + node.z)});
  };
  constexpr double kEnd = 20;
  Mesh block = part(-kEnd, 0.3, -kEnd, kEnd, -kEnd, kTop);  // before the slot
  add(block, part(-kEnd, kEnd, -kEnd, kEnd, -kEnd, -0.2));  // below it
  add(block, part(3.4, kEnd, -kEnd, kEnd, -kEnd, kTop));    // where it ends
  add(block, part(0.7, kEnd, -kEnd, kEnd, 0.2, kTop));      // above its bend
  add(block, part(-kEnd, kEnd, -kEnd, -3, -kEnd, kTop));    // at both its sides
  add(block, part(-kEnd, kEnd, 3, kEnd, -kEnd, kTop));
  add(block, part(-kEnd, -5, -kEnd, -5, -kEnd, kEnd));  // a mast, for the bounds
  if (lid) add(block, part(-kEnd, kEnd, -kEnd, kEnd, 0.3, kTop));
  return block;
}

// A convex prism along z.
Mesh prism(const std::vector<std::array<double, 2>>& outline, double low, double high) {
  Mesh mesh;
  const auto n = std::uint32_t(outline.size());
  for (const auto& [x, y] : outline)
    for (const double z : {low, high}) mesh.vertices.push_back({x, y, z});
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % n);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
    if (i == 0 || i + 1 == n) continue;
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({1, a + 1, b + 1});
  }
  return mesh;
}

}  // namespace

TEST_CASE("pockets: a slanted slot narrower than a voxel is outside 60 voxels deep") {
  constexpr double kHalf = 40, kWide = 0.35;  // along x and y
  Mesh block = prism({{-kHalf, kWide - kHalf}, {kHalf - kWide, kHalf}, {-kHalf, kHalf}}, -6, 6);
  add(block, prism({{kWide - kHalf, -kHalf}, {kHalf, -kHalf}, {kHalf, kHalf - kWide}}, -6, 6));
  add(block, box({-kHalf, -kHalf, -6}, {kHalf - 60, kHalf - 60, 6}));  // the slot's end
  add(block, box({-kHalf, -kHalf, -6}, {kHalf, kHalf, -3}));
  add(block, box({-kHalf, -kHalf, 3}, {kHalf, kHalf, 6}));
  FieldBake options;
  options.voxel_size = 1;
  options.grow_thin = false;
  options.threads = 2;
  const auto field = bake_field(block, options, nullptr);
  REQUIRE(field);
  REQUIRE(field->sign_mode == "closed");
  int nodes = 0, outside = 0;
  for_nodes(*field, [&](std::array<int, 3> n, double d) {
    const Vec3 p = node_position(*field, n);
    if (std::fabs(p.x - p.y) > 0.1 || std::fabs(p.z) > 2 || p.x < kHalf - 59 || p.x > kHalf) return;
    ++nodes;
    outside += d > 0;
  });
  CHECK(nodes >= 200);
  CHECK(outside == nodes);
}

TEST_CASE(
    "pockets: a slot narrower than a voxel is outside beyond its bend, where no straight line "
    "leads; a closed one is inside") {
  FieldBake options;
  options.voxel_size = 1;
  options.grow_thin = false;
  options.threads = 2;
  const auto plain = bake_field(box({-6, -6, -6}, {6, 6, 6}), options, nullptr);
  REQUIRE(plain);
  const auto off = [](double v) { return v - std::floor(v); };
  const Vec3 node{off(plain->origin.x), off(plain->origin.y), off(plain->origin.z)};
  for (const bool lid : {false, true}) {
    CAPTURE(lid);
    const auto field = bake_field(bent_slot(node, lid), options, nullptr);
    REQUIRE(field);
    REQUIRE(field->sign_mode == "closed");
    int nodes = 0, outside = 0;
    for_nodes(*field, [&](std::array<int, 3> n, double d) {
      const Vec3 p = node_position(*field, n) - node;
      if (std::fabs(p.z) > 0.1 || p.x < 0.9 || p.x > 3.1 || std::fabs(p.y) > 1.5) return;
      ++nodes;
      outside += d > 0;
    });
    CHECK(nodes >= 9);
    CHECK(outside == (lid ? 0 : nodes));
  }
}
