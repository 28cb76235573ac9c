// SPDX-License-Identifier: Apache-2.0
// Fields of generated meshes: distances, sides, bounds and bad input.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"
#include "tests/support/sanitized.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;
using h6::io::FieldBakeReport;

namespace {

FieldBake small_bake(int voxels = 64) {
  FieldBake options;
  options.voxels = voxels;
  options.threads = 2;
  return options;
}

FieldData must_bake(const Mesh& mesh, const FieldBake& options = small_bake(),
                    FieldBakeReport* report = nullptr) {
  auto field = bake_field(mesh, options, report);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

bool same_bits(const FieldData& a, const FieldData& b) {
  const auto same = [](const auto& u, const auto& v) {
    return u.size() == v.size() &&
           (u.empty() || std::memcmp(u.data(), v.data(), u.size() * sizeof u[0]) == 0);
  };
  return a.bricks == b.bricks && same(a.brick_index, b.brick_index) && same(a.samples, b.samples) &&
         same(a.far_grid, b.far_grid) && same(a.part, b.part);
}

// Closed meshes: every sample is the distance to the mesh, with the sign of parity.
struct Verdict {
  double worst = 0;  // [voxel], where u is within reach
  std::size_t wrong_side = 0, nodes = 0, inside = 0;
};
Verdict judge_closed(const FieldData& field, const Mesh& mesh, std::size_t every = 1) {
  const Judge judge(mesh);
  Random random(5);
  Verdict v;
  std::size_t count = 0;
  const double h = field.voxel_size;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    if (count++ % every != 0) return;
    const Vec3 p = node_position(field, n);
    const double u = judge.distance(p);
    ++v.nodes;
    v.inside += d < 0;
    if (u < field.band + 2 * h - 1e-3 * h)
      v.worst = std::max(v.worst, std::fabs(std::fabs(d) - u) / h);
    else
      v.worst = std::max(v.worst, (std::fabs(d) - u) / h);  // a lower bound there
    if (u > 1e-4 * h) v.wrong_side += (d < 0) != judge.inside_by_parity(p, random);
  });
  return v;
}

void check_closed(const Mesh& mesh, const FieldBake& options = small_bake(),
                  std::size_t every = 1) {
  FieldBakeReport report;
  const FieldData field = must_bake(mesh, options, &report);
  CHECK(report.closed);
  CHECK(field.sign_mode == "closed");
  CHECK(field.offset == 0);
  const Verdict v = judge_closed(field, mesh, every);
  CHECK(v.nodes > 1000);
  CHECK(v.inside > 100);
  CHECK(v.worst < 1e-3);
  CHECK(v.wrong_side == 0);
}

}  // namespace

TEST_CASE("bake_field: on closed shapes every sample is the distance, with the right side") {
  SUBCASE("box") { check_closed(box({0, 0, 0}, {1, 0.7, 0.4})); }
  SUBCASE("turned box") { check_closed(turned(box({0, 0, 0}, {1, 0.7, 0.4}), 0.3, 0.8)); }
  SUBCASE("sphere") { check_closed(sphere({0.1, 0.2, 0.3}, 0.5), small_bake(), 3); }
  SUBCASE("torus") { check_closed(torus(0.5, 0.2), small_bake(), 3); }
  SUBCASE("L") { check_closed(l_shape(0.01)); }
  SUBCASE("turned L") { check_closed(turned(l_shape(25.0), 1.1, 0.2)); }
  SUBCASE("large triangles, many voxels") {
    check_closed(turned(box({0, 0, 0}, {1, 1, 0.1}, 1), 0.1, 0.2), small_bake(400), 97);
  }
}

TEST_CASE("bake_field: faces exactly on nodes are at distance zero and nothing leaks through") {
  FieldBake options = small_bake();
  options.voxel_size = 0.0625;
  for (const Vec3 size : {Vec3{1, 1, 1}, Vec3{1.0625, 1.0625, 1.0625}, Vec3{1, 1.0625, 0.5}}) {
    const Mesh mesh = box({0, 0, 0}, size, 4);
    const FieldData field = must_bake(mesh, options);
    const Verdict v = judge_closed(field, mesh);
    CHECK(v.worst < 1e-3);
    CHECK(v.wrong_side == 0);
  }
  // A pyramid's edges and tips on nodes, its faces at 45 degrees through them.
  Mesh diamond;
  diamond.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t x : {0u, 1u})
    for (std::uint32_t y : {2u, 3u})
      for (std::uint32_t z : {4u, 5u}) diamond.triangles.push_back({x, y, z});
  for (double voxel : {0.0625, 2.0 / 33}) {
    options.voxel_size = voxel;
    const Verdict v = judge_closed(must_bake(diamond, options), diamond);
    CHECK(v.worst < 1e-3);
    CHECK(v.wrong_side == 0);
  }
}

TEST_CASE("bake_field: inside-out, mixed and doubled meshes give the same field") {
  const Mesh mesh = turned(l_shape(1.0), 0.4, 0.3);
  const FieldData field = must_bake(mesh);
  Mesh flipped = mesh, mixed = mesh, doubled = mesh;
  for (auto& t : flipped.triangles) std::swap(t[0], t[1]);
  for (std::size_t i = 0; i < mixed.triangles.size(); i += 3)
    std::swap(mixed.triangles[i][0], mixed.triangles[i][2]);
  doubled.triangles.insert(doubled.triangles.end(), flipped.triangles.begin(),
                           flipped.triangles.end());
  for (const Mesh& other : {flipped, mixed, doubled}) {
    const FieldData again = must_bake(other);
    CHECK(again.sign_mode == "closed");
    REQUIRE(again.samples.size() == field.samples.size());
    double worst = 0;
    for (std::size_t i = 0; i < field.samples.size(); ++i) {
      worst = std::max(worst, std::fabs(double(again.samples[i]) - field.samples[i]));
      CHECK((again.samples[i] < 0) == (field.samples[i] < 0));
    }
    CHECK(worst < 1e-5 * field.voxel_size);  // the order of corners changes the last bits
  }
}

TEST_CASE("bake_field: the number of threads and the watcher do not change a bit") {
  Mesh mesh = torus(0.5, 0.15);
  add(mesh, turned(box({-0.5, -0.1, -0.1}, {0.5, 0.1, 0.1}), 0.4, 0.7));
  for (double offset : {-1.0, 0.02}) {
    FieldBake options = small_bake(96);
    options.offset = offset;
    options.threads = 1;
    const FieldData one = must_bake(mesh, options);
    options.threads = 2;
    CHECK(same_bits(one, must_bake(mesh, options)));
    options.threads = 5;
    const auto watched =
        bake_field(mesh, options, nullptr, [](const std::string&, double) { return true; });
    REQUIRE(watched);
    CHECK(same_bits(one, *watched));
  }
}

TEST_CASE("bake_field: two overlapping boxes are one solid, and the walls inside it do not count") {
  Mesh mesh = box({0, 0, 0}, {1, 0.6, 0.6});
  add(mesh, box({0.5, 0.1, 0.1}, {1.5, 0.5, 0.5}));
  FieldBake options = small_bake(96);
  SUBCASE("within the usual band") {}
  SUBCASE("within a wide band") { options.band_voxels = 8; }
  const double reach = options.band_voxels;
  const FieldData field = must_bake(mesh, options);
  for (const unsigned threads : {1u, 5u}) {
    options.threads = threads;
    CHECK(same_bits(field, must_bake(mesh, options)));
  }
  CHECK(field.sign_mode == "closed");
  const double h = field.voxel_size;
  const auto in = [](Vec3 p, Vec3 low, Vec3 high) {
    return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y &&
           p.z < high.z;
  };
  // The way out leads to points of either surface that are not inside the other box.
  std::vector<Vec3> skin;
  const std::pair<Vec3, Vec3> boxes[2] = {{{0, 0, 0}, {1, 0.6, 0.6}},
                                          {{0.5, 0.1, 0.1}, {1.5, 0.5, 0.5}}};
  for (int which = 0; which < 2; ++which) {
    const auto [low, high] = boxes[which];
    const Mesh fine = box(low, high, 160);
    for (const Vec3& v : fine.vertices)
      if (!in(v, boxes[1 - which].first, boxes[1 - which].second)) skin.push_back(v);
  }
  const Judge judge(mesh);
  Random random(4);
  std::size_t wrong = 0, buried = 0;
  double worst_outside = 0, too_long = 0, too_short = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    const Vec3 p = node_position(field, n);
    const double u = judge.distance(p);
    if (u < 1e-4 * h) return;
    const bool inside =
        in(p, boxes[0].first, boxes[0].second) || in(p, boxes[1].first, boxes[1].second);
    wrong += inside != (d < 0);
    if (!inside && u < field.band) worst_outside = std::max(worst_outside, std::fabs(d - u));
    if (!inside || random(0, 1) > 0.05) return;
    double out = 1e9;
    for (const Vec3& s : skin) out = std::min(out, norm(p - s));
    if (out > reach * h) return;
    buried += u < out - h;
    too_long = std::max(too_long, (-d - out) / h);
    too_short = std::max(too_short, (out + d) / h);
  });
  CHECK(wrong == 0);
  CHECK(worst_outside < 1e-3 * h);
  CHECK(buried > 10);
  CHECK(too_long < 0.01);
  CHECK(too_short < 0.74 + 0.13 * reach + 0.1);  // and 0.1 because the skin is made of points
  MESSAGE("way out too short by at most ", too_short, " voxel, too long by ", too_long);
}

TEST_CASE(
    "bake_field: where walls are buried aslant, no node is deeper than the next outside is far") {
  // A part of the second box is buried in the first. Bricks with a buried sheet lie beside bricks
  // without one, and the way out leads through the latter.
  struct Second {
    Vec3 low, high;
    double turn, tilt;
  };
  for (const Second& second :
       {Second{{0.218, -0.545, 0.010}, {0.888, -0.243, 0.803}, 0.839, 0.362},
        Second{{-0.28, -0.51, -0.516}, {0.712, 0.002, 0.256}, 0.064, 0.581}}) {
    Mesh mesh = box({-1, -1, -0.6}, {1, 1, 0.6}, 3);
    add(mesh, turned(box(second.low, second.high, 3), second.turn, second.tilt));
    const FieldData f = must_bake(mesh, small_bake(96));
    std::size_t wrong = 0, seen = 0;
    double worst = 0;
    for_nodes(f, [&](std::array<int, 3> n, double d) {
      const double depth = -d / f.voxel_size;
      if (depth <= 0 || depth > 3.5) return;
      double way = 9;  // [voxel] to the next node outside
      for (int i = 0; i < 9 * 9 * 9; ++i) {
        const int by[3] = {i % 9 - 4, i / 9 % 9 - 4, i / 81 - 4};
        const float* there = node_sample(f, {n[0] + by[0], n[1] + by[1], n[2] + by[2]});
        if (there != nullptr && *there > 0)
          way = std::min(way, std::sqrt(double(by[0] * by[0] + by[1] * by[1] + by[2] * by[2])));
      }
      if (way > 4) return;
      ++seen;
      wrong += depth > way + 1e-3;
      worst = std::max(worst, depth - way);
    });
    CHECK(seen > 2000);
    INFO("deeper by ", worst, " voxel");
    CHECK(wrong == 0);
  }
}

TEST_CASE("bake_field: an open sheet becomes a plate two offsets thick") {
  const Mesh mesh = turned(patch(6, 6, [](double s, double t) { return Vec3{s, t, 0}; }), 0.3, 0.5);
  FieldBakeReport report;
  const FieldData field = must_bake(mesh, small_bake(), &report);
  CHECK_FALSE(report.closed);
  CHECK(field.sign_mode == "flood");
  CHECK(field.offset == h6::test::near(0.9 * field.voxel_size));
  CHECK_FALSE(report.warnings.empty());
  const Judge judge(mesh);
  double worst = 0;
  std::size_t inside = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    const double u = judge.distance(node_position(field, n));
    inside += d < 0;
    if (u < field.band) worst = std::max(worst, std::fabs(d - (u - field.offset)));
  });
  CHECK(inside > 1000);
  CHECK(worst < 1e-3 * field.voxel_size);
}

TEST_CASE(
    "bake_field: a large soup without an offset bakes: nothing is thick, distances are exact, "
    "and it is said that the outside leaks in") {
  Random random(11);
  Mesh mesh;
  for (int sheet = 0; sheet < 1500; ++sheet) {
    const double size = random(0.02, 0.15), bend = random(-0.05, 0.05);
    const Mesh flat = patch(3, 3, [&](double s, double t) {
      return Vec3{size * (s - 0.5), size * (t - 0.5), bend * s * t};
    });
    add(mesh, shifted(turned(flat, random(0, 6), random(0, 6)),
                      {random(-1, 1), random(-1, 1), random(-1, 1)}));
  }
  FieldBake options = small_bake(160);
  options.offset = 0;
  FieldBakeReport report;
  const FieldData field = must_bake(mesh, options, &report);
  CHECK(mesh.triangles.size() == 27000);
  CHECK(field.offset == 0);
  CHECK_FALSE(report.closed);
  CHECK(std::any_of(report.warnings.begin(), report.warnings.end(),
                    [](const std::string& s) { return s.find("leaks in") != std::string::npos; }));
  const Judge judge(mesh);
  std::size_t count = 0, checked = 0, inside = 0, short_way = 0;
  double worst = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    if (count++ % 61 != 0) return;
    const double u = judge.distance(node_position(field, n));
    if (u > field.band) return;
    ++checked;
    if (d >= 0) {
      worst = std::max(worst, std::fabs(d - u));
    } else {  // enclosed by sheets that meet
      ++inside;
      short_way += -d < u - 1e-3 * field.voxel_size;
    }
  });
  CHECK(checked > 10000);
  CHECK(worst < 1e-3 * field.voxel_size);
  CHECK(short_way == 0);
  CHECK(double(inside) < 0.05 * double(checked));
  options.threads = 1;
  CHECK(same_bits(field, must_bake(mesh, options)));
}

TEST_CASE("bake_field: a box with cracks narrower than the offset is solid") {
  // Faces drawn in by half a voxel: every edge of the box is a crack.
  const double gap = 0.5 / 48;
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (double side : {0.0, 1.0})
      add(mesh, patch(3, 3, [&](double s, double t) {
            double c[3];
            c[axis] = side;
            c[(axis + 1) % 3] = gap + (1 - 2 * gap) * s;
            c[(axis + 2) % 3] = gap + (1 - 2 * gap) * t;
            return Vec3{c[0], c[1], c[2]};
          }));
  const FieldData field = must_bake(mesh);
  const double h = field.voxel_size, sigma = field.offset;
  CHECK(field.sign_mode == "flood");
  const Judge judge(mesh);
  std::size_t wrong = 0, checked = 0;
  double worst = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    const Vec3 p = node_position(field, n);
    const double u = judge.distance(p);
    if (u > field.band) return;
    const double c[3] = {p.x, p.y, p.z};
    bool inside = true;
    int near_sides = 0;
    for (double x : c) {
      inside &= x > 0 && x < 1;
      near_sides += std::min(std::fabs(x), std::fabs(x - 1)) < 4 * h;
    }
    if (inside) wrong += d >= 0;
    if (!inside && u > sigma + 1e-4 * h) wrong += d < 0;
    if (near_sides > 1) return;  // at cracks the value is between bounds; away from them exact
    ++checked;
    worst = std::max(worst, std::fabs(d - ((inside ? -u : u) - sigma)));
  });
  CHECK(wrong == 0);
  CHECK(checked > 5000);
  CHECK(worst < 1e-3 * h);
}

TEST_CASE("bake_field: cavities are solid by default and open when hollow is asked for") {
  Mesh mesh = sphere({0, 0, 0}, 0.5);
  add(mesh, sphere({0, 0, 0}, 0.25));
  add(mesh, sphere({0, 0, 0}, 0.1, 12));
  FieldBake options = small_bake();
  const auto side = [](const FieldData& f, double x) {
    const Vec3 g = (1 / f.voxel_size) * (Vec3{x, 0, 0} - f.origin);
    const float* d =
        node_sample(f, {int(std::lround(g.x)), int(std::lround(g.y)), int(std::lround(g.z))});
    if (d != nullptr) return *d < 0 ? -1 : 1;
    const std::size_t a = std::size_t(std::lround(g.x / 8)), b = std::size_t(std::lround(g.y / 8)),
                      c = std::size_t(std::lround(g.z / 8));
    return f.far_grid[(c * std::size_t(f.bricks[1] + 1) + b) * std::size_t(f.bricks[0] + 1) + a] < 0
               ? -1
               : 1;
  };
  const FieldData solid = must_bake(mesh, options);
  for (double x : {0.0, 0.17, 0.38}) CHECK(side(solid, x) == -1);
  CHECK(side(solid, 0.6) == 1);
  options.cavities = h6::io::Cavities::hollow;
  const FieldData hollow = must_bake(mesh, options);
  CHECK(side(hollow, 0.38) == -1);
  CHECK(side(hollow, 0.17) == 1);
  CHECK(side(hollow, 0.0) == -1);
  const Verdict v = judge_closed(hollow, mesh, 3);
  CHECK(v.worst < 1e-3);
  CHECK(v.wrong_side == 0);
}

TEST_CASE("bake_field: the far grid never says more than the true distance, nor a voxel less") {
  const auto check = [](const Mesh& mesh, const FieldBake& options) {
    const FieldData field = must_bake(mesh, options);
    const Judge judge(mesh);
    const double h = field.voxel_size;
    std::size_t too_long = 0, at = 0;
    double loosest = 0;
    for (int c = 0; c <= field.bricks[2]; ++c)
      for (int b = 0; b <= field.bricks[1]; ++b)
        for (int a = 0; a <= field.bricks[0]; ++a, ++at) {
          const double u = judge.distance(node_position(field, {8 * a, 8 * b, 8 * c}));
          const double d = field.far_grid[at];
          const double truth = d < 0 ? u + field.offset : u - field.offset;
          too_long += std::fabs(d) > std::max(truth, 0.0) + 1e-12;
          if (d > 0) loosest = std::max(loosest, (truth - d) / h);
          if (const float* s = node_sample(field, {8 * a, 8 * b, 8 * c}); s && std::fabs(d) > 0)
            CHECK((*s < 0) == (d < 0));
        }
    CHECK(too_long == 0);
    CHECK(loosest < 1.02);  // and on average much less: bake_far_test.cpp
  };
  check(turned(l_shape(1.0), 0.4, 0.3), small_bake(96));
  check(patch(6, 6, [](double s, double t) { return Vec3{s, t, 0.2 * s * t}; }), small_bake(96));
}

TEST_CASE("bake_field: every cell nearer than the band to the zero set has all its nodes") {
  const auto check = [](const Mesh& mesh) {
    const FieldData field = must_bake(mesh);
    const Judge judge(mesh);
    Random random(3);
    std::size_t missing = 0, near = 0;
    for (int i = 0; i < h6::test::repeated(60000, 15000); ++i) {
      const Vec3 p = field.origin + Vec3{random(0, 8 * field.bricks[0] - 1) * field.voxel_size,
                                         random(0, 8 * field.bricks[1] - 1) * field.voxel_size,
                                         random(0, 8 * field.bricks[2] - 1) * field.voxel_size};
      if (judge.distance(p) - field.offset >= field.band) continue;
      ++near;
      double value;
      missing += !interpolate(field, p, value);
    }
    CHECK(near > 1000);
    CHECK(missing == 0);
  };
  check(turned(l_shape(1.0), 0.4, 0.3));
  check(turned(patch(1, 1, [](double s, double t) { return Vec3{s, t, 0}; }), 0.3, 0.5));
}

TEST_CASE("bake_field: a plate thinner than a voxel is said to have grown, with its thickness") {
  FieldBakeReport report;
  const Mesh plate = box({0, 0, 0}, {1, 1, 0.5 / 48});
  FieldBake options = small_bake();
  options.padding_voxels = 8;
  must_bake(turned(plate, 0.2, 0.3), options, &report);
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].find("such as one of 10.42 mm") != std::string::npos);
  CHECK(report.thin.area > 1.9);
  FieldBakeReport solid;
  must_bake(turned(box({0, 0, 0}, {1, 1, 0.4}), 0.2, 0.3), options, &solid);
  CHECK(solid.warnings.empty());
  // An offset keeps it.
  options.sign = h6::io::SignMode::flood;
  const FieldData kept = must_bake(turned(plate, 0.2, 0.3), options);
  std::size_t inside = 0;
  for (float d : kept.samples) inside += d < 0;
  CHECK(inside > 1000);
}

TEST_CASE(
    "bake_field: wires and sheets thinner than a voxel stay obstacles along their whole "
    "length, and the user is told") {
  const double h = 1.0 / 48;
  FieldBake options = small_bake();
  options.voxel_size = h;
  const auto tube = [&](double radius) {
    return patch(40, 8, [&](double s, double t) {
      return Vec3{s, 0.3 + radius * std::cos(2 * M_PI * t), 0.2 + radius * std::sin(2 * M_PI * t)};
    });
  };
  for (const double radius : {0.02 * h, 0.3 * h}) {  // open at its ends
    FieldBakeReport report;
    Mesh mesh = tube(radius);
    add(mesh, patch(4, 4, [](double s, double t) { return Vec3{s, t, 0.7}; }));
    const FieldData field = must_bake(turned(h6::io::weld(mesh), 0.3, 0.6), options, &report);
    const Mesh places = turned(
        [] {
          Mesh points;
          for (int i = 0; i <= 400; ++i) {
            points.vertices.push_back({i / 400.0, 0.3, 0.2});
            points.vertices.push_back({i / 400.0, 0.45, 0.7});
          }
          return points;
        }(),
        0.3, 0.6);
    std::size_t lost = 0;
    for (const Vec3& p : places.vertices) {
      double value = 1;
      lost += !interpolate(field, p, value) || value >= 0;
    }
    CHECK(lost == 0);
    CHECK(std::any_of(report.warnings.begin(), report.warnings.end(), [](const std::string& w) {
      return w.find("sheets become") != std::string::npos && w.find("wires") != std::string::npos;
    }));
  }
}

TEST_CASE("bake_field: far from the origin nothing is lost") {
  const Mesh here = turned(l_shape(0.01), 0.4, 0.3);
  const Vec3 there{1e5, -1e5, 1e5};
  const FieldData near = must_bake(here), far = must_bake(shifted(here, there));
  CHECK(near.brick_index == far.brick_index);
  REQUIRE(near.samples.size() == far.samples.size());
  double worst = 0;
  for (std::size_t i = 0; i < near.samples.size(); ++i)
    worst = std::max(worst, std::fabs(double(near.samples[i]) - far.samples[i]));
  CHECK(worst < 1e-3 * near.voxel_size);  // coordinates themselves are rounded to 1.5e-11 m
}

TEST_CASE("bake_field: the smallest meshes") {
  Mesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  const FieldData field = must_bake(one);
  CHECK(field.sign_mode == "flood");
  CHECK(std::any_of(field.samples.begin(), field.samples.end(), [](float d) { return d < 0; }));
  for (int voxels : {16, 17, 31}) must_bake(one, small_bake(voxels));
  FieldBake huge_offset = small_bake();
  huge_offset.offset = 0.2;
  const FieldData thick = must_bake(one, huge_offset);
  CHECK(thick.offset == h6::test::near(0.2));
  const Judge judge(one);
  double worst = 0;
  for_nodes(thick, [&](std::array<int, 3> n, double d) {
    const double u = judge.distance(node_position(thick, n));
    if (u > 0.2 && u < 0.2 + thick.band) worst = std::max(worst, std::fabs(d - (u - 0.2)));
  });
  CHECK(worst < 1e-3 * thick.voxel_size);
}

TEST_CASE("bake_field: bad input is one sentence") {
  const auto fails = [](const Mesh& mesh, const FieldBake& options, const std::string& about) {
    const auto field = bake_field(mesh, options, nullptr);
    REQUIRE_FALSE(field);
    INFO(field.error());
    CHECK(field.error().find(about) != std::string::npos);
  };
  Mesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}, {0, 0, 1}};
  fails({}, {}, "no triangle");
  fails(flat, {}, "no triangle with area");
  const Mesh good = box({0, 0, 0}, {1, 1, 1});
  Mesh broken = good;
  broken.triangles[3][1] = 1000000;
  fails(broken, {}, "triangle 3");
  broken = good;
  broken.vertices[0].y = std::numeric_limits<double>::quiet_NaN();
  fails(broken, {}, "not finite");
  FieldBake options;
  for (int voxels : {0, 15, 2049, -3}) {
    options.voxels = voxels;
    fails(good, options, "16 to 2048");
  }
  options = {};
  options.voxel_size = 1e-4;
  fails(good, options, "choose at least");
  options.voxel_size = std::numeric_limits<double>::infinity();
  fails(good, options, "voxel size");
  options = {};
  options.offset = 1e6;
  fails(good, options, "offset");
}

TEST_CASE("bake_field: a cancelled bake says so, wherever it stops") {
  const Mesh mesh = sphere({0, 0, 0}, 1, 12);
  std::size_t calls = 0;
  std::set<std::string> names;
  double last = 0;
  bool rising = true;
  REQUIRE(bake_field(mesh, small_bake(), nullptr, [&](const std::string& what, double done) {
    ++calls;
    names.insert(what);
    rising &= done >= last && done <= 1;
    last = done;
    return true;
  }));
  CHECK(calls > 10);
  CHECK(names.size() >= 4);
  CHECK(rising);
  for (std::size_t stop = 0; stop < calls; stop += 5) {
    std::size_t call = 0;
    const auto field = bake_field(mesh, small_bake(), nullptr,
                                  [&](const std::string&, double) { return call++ < stop; });
    REQUIRE_FALSE(field);
    CHECK(field.error() == "cancelled");
  }
}
