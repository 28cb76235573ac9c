// SPDX-License-Identifier: Apache-2.0
// Compares Embree's answers with an independent judge, and runs the exact check on right fields and
// on fields with known errors.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "io/check/exact_check.h"

#include "io/bake/bake_field.h"
#include "io/check/ray_votes.h"
#include "tests/io/bake/field_check.h"
#include "tests/support/sanitized.h"

using namespace field_check;
using namespace h6::io;

namespace {

std::unique_ptr<RayScene> rays_at(const Mesh& mesh) {
  auto made = RayScene::make(mesh);
  REQUIRE(made);
  return std::move(*made);
}

FieldData bake(const Mesh& mesh, int voxels = 96) {
  FieldBake options;
  options.voxels = voxels;
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

ExactCheck check(const Mesh& mesh, const FieldData& field, unsigned threads = 2) {
  ExactCheckOptions options;
  options.points = 4000, options.far_points = 4000, options.threads = threads;
  auto found = check_exactly(mesh, field, options);
  REQUIRE_MESSAGE(found, found.error());
  return *found;
}

// A ball within a ball, both wound outward.
Mesh hollow_ball() {
  Mesh mesh = sphere({0, 0, 0}, 1.0);
  add(mesh, sphere({0, 0, 0}, 0.5));
  return mesh;
}

}  // namespace

TEST_CASE("distances by Embree are exact in double: near, far, far from the origin, of slivers") {
  for (const Vec3 by : {Vec3{0, 0, 0}, Vec3{1e4, -2e4, 3e3}}) {
    const Mesh mesh = shifted(shards(500), by);
    const auto rays = rays_at(mesh);
    const Judge judge(mesh);
    Random random(5);
    for (int i = 0; i < h6::test::repeated(3000, 300); ++i) {
      const double reach = i % 3 == 0 ? 30 : 1.2;
      const Vec3 p = by + reach * Vec3{random(-1, 1), random(-1, 1), random(-1, 1)};
      const double truth = judge.distance(p), found = rays->distance(p);
      CHECK(std::fabs(found - truth) < 1e-12 * (1 + norm(by)));
    }
  }
}

TEST_CASE("the first of equally near triangles is the nearest, and none at the limit or beyond") {
  Mesh mesh = patch(8, 8, [](double s, double t) { return Vec3{s, t, 0}; });
  std::reverse(mesh.triangles.begin(), mesh.triangles.end());
  const auto rays = rays_at(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3 above = mesh.vertices[v] + Vec3{0, 0, 0.25};
    std::uint32_t first = 0;
    const auto has = [&](const auto& t) { return t[0] == v || t[1] == v || t[2] == v; };
    while (!has(mesh.triangles[first])) ++first;
    const RayScene::Near near = rays->nearest(above);
    CHECK(near.triangle == first);
    CHECK(near.distance == 0.25);
    CHECK(norm(near.point - mesh.vertices[v]) < 1e-12);
    CHECK(rays->nearest(above, 0.26).triangle == first);
    CHECK(rays->nearest(above, 0.25).triangle == RayScene::kNoTriangle);
  }
}

TEST_CASE("a ray meets every triangle of its way, in order, and the first one at its free way") {
  const Mesh mesh = hollow_ball();
  const auto rays = rays_at(mesh);
  Random random(7);
  std::vector<Crossing> way;
  for (int i = 0; i < h6::test::repeated(500, 100); ++i) {
    Dice dice(1, std::uint64_t(i));
    const Vec3 along = dice.direction();
    CHECK(norm(along) > 0.999999);
    CHECK(norm(along) < 1.000001);
    rays->crossings({0.01, 0.02, -0.03}, along, way);
    REQUIRE(way.size() == 2);  // out of the small ball, out of the big one
    CHECK(way[0].t < way[1].t);
    CHECK(way[0].t > 0.45);
    CHECK(way[0].t < 0.55);
    CHECK(way[1].t > 0.9);
    CHECK(way[1].t < 1.05);
    CHECK(std::fabs(rays->free_way({0.01, 0.02, -0.03}, along) - way[0].t) < 1e-5);
    CHECK(rays->meets({0.01, 0.02, -0.03}, along));
    rays->crossings({0, 0, 4}, {0, 0, 1}, way);
    CHECK(way.empty());
    CHECK(!rays->meets({0, 0, 4}, {0, 0, 1}));
    CHECK(std::isinf(rays->free_way({0, 0, 4}, {0, 0, 1})));
  }
}

TEST_CASE("votes: parts that overlap are one solid, a hollow is not, a bowl can be left") {
  Mesh mesh = box({0, 0, 0}, {2, 1, 1});
  add(mesh, box({1, 0.25, 0.25}, {3, 0.75, 0.75}));  // runs into the first
  Mesh turned_in = sphere({1.5, 5, 0}, 0.5);         // a hollow in a ball
  for (auto& t : turned_in.triangles) std::swap(t[0], t[1]);
  add(mesh, sphere({1.5, 5, 0}, 1.0));
  add(mesh, turned_in);
  const auto rays = rays_at(mesh);
  const FaceTable faces = face_table(mesh);
  const RayVotes votes(*rays, faces);
  using Side = RayVotes::Side;
  const auto side = [&](Vec3 p) {
    Dice dice(11, 1);
    return votes.side(p, dice);
  };
  CHECK(side({0.5, 0.5, 0.5}) == Side::inside);
  CHECK(side({1.5, 0.5, 0.5}) == Side::inside);  // in both: an even number of crossings
  CHECK(side({2.5, 0.5, 0.5}) == Side::inside);
  CHECK(side({2.5, 0.1, 0.5}) == Side::outside);
  CHECK(side({1.5, 5.75, 0}) == Side::inside);
  CHECK(side({1.5, 5.1, 0}) == Side::outside);  // in the hollow
  Dice dice(13, 1);
  CHECK(votes.way_out({2.5, 0.1, 0.5}, 0.05, 100, dice));
  CHECK(!votes.way_out({1.5, 5.1, 0}, 0, 300, dice));
  CHECK(!votes.way_out({0.5, 0.5, 0.5}, 0, 300, dice));

  // A small ball leaves a box without a lid; a ball as wide as the box does not.
  Mesh open = box({0, 0, 0}, {1, 1, 1});
  std::erase_if(open.triangles, [&](const auto& t) {
    return open.vertices[t[0]].z + open.vertices[t[1]].z + open.vertices[t[2]].z > 2.99;
  });
  const auto open_rays = rays_at(open);
  const FaceTable open_faces = face_table(open);
  const RayVotes open_votes(*open_rays, open_faces);
  CHECK(open_votes.way_out({0.5, 0.5, 0.5}, 0.2, 300, dice));
  CHECK(!open_votes.way_out({0.5, 0.5, 0.45}, 0.48, 300, dice));
}

TEST_CASE("bake_field's fields agree with their meshes: closed, overlapping, open, of one sheet") {
  Mesh overlapping = turned(l_shape(1.0), 0.4, 0.3);
  add(overlapping, sphere({0.7, 0.7, 0.5}, 0.6));
  for (const Mesh& mesh :
       {torus(1.0, 0.4), overlapping, hollow_ball(), patch(6, 6, [](double s, double t) {
          return Vec3{s, t, s * t};
        })}) {
    const ExactCheck c = check(mesh, bake(mesh));
    CAPTURE(mesh.triangles.size());
    CAPTURE(c.far_excess);
    CHECK(c.agrees());
    CHECK(c.nodes > 3000);
    CHECK(c.worst_node < 1e-3);
    CHECK(c.wrong_sides() == 0);
    CHECK(c.far > 3000);
    CHECK(c.far_wrong == 0);
    CHECK(c.worst_deep < 2.5);
    CHECK(c.corner_gap < 0.3);
  }
  // Its bounds are tight on either side.
  const Mesh ball = sphere({0, 0, 0}, 1.0);
  const ExactCheck both = check(ball, bake(ball));
  CHECK(both.agrees());
  CHECK(both.far_gap < 1);
  CHECK(both.inside > 30);
  CHECK(both.inside_gap > 0);
  CHECK(both.inside_gap < 1);
  // With a hole it drains: every distance is right, and the votes show the lost side.
  Mesh open = torus(1.0, 0.4);
  open.triangles.resize(open.triangles.size() - 40);
  FieldBake soup;
  soup.voxels = 96, soup.sign = h6::io::SignMode::flood;
  const auto drained = bake_field(open, soup, nullptr);
  REQUIRE(drained);
  const ExactCheck c = check(open, *drained);
  CHECK(c.drains());
  CHECK_FALSE(c.agrees());
  CHECK(c.leak_depth > 1);
  CHECK(c.drained > 100);
  CHECK(c.filled == 0);
  CHECK(c.far_wrong == 0);
}

TEST_CASE(
    "a sealed hole is nearer than the mesh, from outside and from within, and that is right") {
  Mesh holed = box({0, 0, 0}, {1, 1, 1}, 24);
  std::erase_if(holed.triangles, [&](const auto& t) {
    const Vec3 m = (1.0 / 3) * (holed.vertices[t[0]] + holed.vertices[t[1]] + holed.vertices[t[2]]);
    return m.z > 1 - 1e-9 && std::fabs(m.x - 0.5) < 0.2 && std::fabs(m.y - 0.5) < 0.2;
  });
  FieldBake options;
  options.voxels = 64, options.seal = 0.6;
  auto field = bake_field(holed, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  ExactCheckOptions asked;
  asked.sealed = true;
  auto c = check_exactly(holed, *field, asked);
  REQUIRE_MESSAGE(c, c.error());
  CHECK(c->nearer > 30);
  CHECK(c->agrees());
  asked.sealed = false;  // hides from the check that the bake sealed holes
  c = check_exactly(holed, *field, asked);
  REQUIRE_MESSAGE(c, c.error());
  CHECK(!c->agrees());
}

TEST_CASE("whatever is wrong with a field shows, and where") {
  const Mesh mesh = torus(1.0, 0.4);
  const FieldData good = bake(mesh);
  REQUIRE(check(mesh, good).agrees());

  FieldData wider = good;  // samples a hundredth of a voxel off
  for (float& s : wider.samples) s += float(0.01 * good.voxel_size);
  ExactCheck c = check(mesh, wider);
  CHECK(!c.agrees());
  CHECK(c.worst_node > 0.009);
  CHECK(c.worst_node < 0.011);

  FieldData drained = good;  // outside everywhere
  for (float& s : drained.samples) s = std::fabs(s);
  for (float& s : drained.far_grid) s = std::fabs(s);
  c = check(mesh, drained);
  CHECK(!c.agrees());
  CHECK(c.drained > 1000);
  CHECK(c.filled == 0);
  CHECK(c.worst_node < 1e-3);

  FieldData filled = good;  // one brick in four is inside, whatever the mesh says
  for (std::size_t i = 0; i < filled.samples.size(); ++i)
    if (i / 512 % 4 == 0) filled.samples[i] = -std::fabs(filled.samples[i]);
  c = check(mesh, filled);
  CHECK(!c.agrees());
  CHECK(c.filled > 300);
  CHECK(c.drained == 0);

  FieldData deeper = good;  // the inside two voxels further down than it is
  for (float& s : deeper.samples)
    if (s < 0) s -= float(2 * good.voxel_size);
  c = check(mesh, deeper);
  CHECK(c.deep > 1000);
  CHECK(c.worst_deep > 1.9);
  CHECK(!c.agrees());

  FieldData promises = good;  // a bound one voxel too good
  for (float& f : promises.far_grid) f += std::copysign(float(good.voxel_size), f);
  c = check(mesh, promises);
  CHECK(!c.agrees());
  CHECK(c.far_wrong > 100);
  CHECK(c.far_excess > 0.9);

  FieldData careful = good;  // three voxels too low: safe, but reported as loose
  for (float& f : careful.far_grid)
    f = std::copysign(std::max(0.f, std::fabs(f) - float(3 * good.voxel_size)), f);
  c = check(mesh, careful);
  CHECK(c.agrees());
  CHECK(c.corner_gap > 2.5);
  CHECK(c.far_gap > check(mesh, good).far_gap + 1);
}

TEST_CASE("a field of another mesh, or of nothing, is refused with a sentence") {
  const FieldData field = bake(torus(1.0, 0.4));
  const auto other = check_exactly(shifted(torus(1.0, 0.4), {40, 0, 0}), field, {});
  REQUIRE(!other);
  CHECK(other.error().find("another mesh") != std::string::npos);
  Mesh line;
  line.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles = {{0, 1, 2}};
  CHECK(!check_exactly(line, field, {}));
  const auto cancelled =
      check_exactly(torus(1.0, 0.4), field, {}, [](const std::string&, double) { return false; });
  REQUIRE(!cancelled);
  CHECK(cancelled.error() == "cancelled");
}

TEST_CASE("one thread or four: the same counts and the same digits") {
  Mesh mesh = turned(l_shape(1.0), 0.4, 0.3);
  mesh.triangles.pop_back();
  const FieldData field = bake(mesh);
  const ExactCheck one = check(mesh, field, 1), four = check(mesh, field, 4);
  CHECK(one.worst_node == four.worst_node);
  CHECK(one.mean_node == four.mean_node);
  CHECK(one.mean_between == four.mean_between);
  CHECK(one.far_gap == four.far_gap);
  CHECK(one.voted == four.voted);
  CHECK(one.doubtful == four.doubtful);
}

namespace {

// Takes the samples of the bricks that `drop` picks, by their first and last node, from a field.
// Returns how many it took.
template <class Drop>
std::size_t drop_bricks(FieldData& field, Drop&& drop) {
  std::size_t dropped = 0, cell = 0;
  for (int z = 0; z < field.bricks[2]; ++z)
    for (int y = 0; y < field.bricks[1]; ++y)
      for (int x = 0; x < field.bricks[0]; ++x) {
        std::int32_t& row = field.brick_index[cell++];
        if (row < 0 || !drop(node_position(field, {8 * x, 8 * y, 8 * z}),
                             node_position(field, {8 * x + 8, 8 * y + 8, 8 * z + 8})))
          continue;
        row = -1;
        ++dropped;
      }
  return dropped;
}

}  // namespace

TEST_CASE("a field with a tolerance needs no samples beside a sheet buried deep, but all others") {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1}, 1);
  add(mesh, box({0.35, 0.35, 0.35}, {0.65, 0.65, 0.65}, 1));
  FieldBake options;
  // So bricks end two thirds of a coarse voxel below the walls at high x, y and z.
  options.tolerance = 1 / 398.4, options.padding_voxels = 12;
  const auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  double there = 0;
  REQUIRE_FALSE(interpolate(*field, {0.5, 0.5, 0.645}, there));
  const ExactCheck whole = check(mesh, *field);
  CHECK(whole.agrees());
  CHECK(whole.asked > 3000);
  CHECK(whole.asked < 3900);  // a twelfth of the surface is buried

  // Near the outer walls samples are missed, even in a brick that lies in the solid altogether.
  const auto in = [](Vec3 p) { return std::min({p.x, p.y, p.z, 1 - p.x, 1 - p.y, 1 - p.z}) > 0; };
  for (const bool altogether : {true, false}) {
    CAPTURE(altogether);
    FieldData holed = *field;
    const auto drop = [&](Vec3 low, Vec3 high) {
      return altogether ? in(low) && in(high) && high.x > 0.98 : high.x > 1;
    };
    CHECK(drop_bricks(holed, drop) > 10);
    const ExactCheck c = check(mesh, holed);
    CHECK(c.missed > 100);  // cells of the bricks beside them, which miss a corner, are 53
    CHECK_FALSE(c.agrees());
  }
}
