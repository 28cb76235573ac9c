// SPDX-License-Identifier: Apache-2.0
// through_test.cpp - which points popped through a mesh: on paths that are given, and in runs.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "io/experiments/run.h"
#include "io/run/through_watch.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;
using h6::test::load;
using io::kMm;

namespace {

using Loaded = std::unique_ptr<io::LoadedScene>;

// Squares of `size` in the plane z = 0, two triangles each: n x n of them around the origin.
io::Mesh sheet(double size, int n) {
  io::Mesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      mesh.vertices.push_back({size * (i - 0.5 * n), size * (j - 0.5 * n), 0});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto v = static_cast<std::uint32_t>(j * (n + 1) + i),
                 w = v + static_cast<std::uint32_t>(n);
      mesh.triangles.push_back({v, v + 1, w + 2});
      mesh.triangles.push_back({v, w + 2, w + 1});
    }
  return mesh;
}

// A probe of these points, held by a hand, and an obstacle with voxels of 1 mm.
io::Scene probe_and(io::Mesh mesh, const std::vector<h6Vec3>& points = {{0, 0, 0}}) {
  io::Scene scene = io::common_scene("probe", "");
  scene.bodies.push_back(io::obstacle("obstacle", std::move(mesh), kMm));
  io::SceneBody probe;
  probe.name = "probe";
  probe.com = h6Vec3{0, 0, 0};
  probe.inertia = io::box_inertia(probe.mass, {kMm, kMm, kMm});
  probe.shell.emplace();
  io::PointCloud& cloud = probe.shell->points.emplace();
  for (const h6Vec3& p : points) {
    cloud.x.push_back(static_cast<float>(p.x)), cloud.y.push_back(static_cast<float>(p.y));
    cloud.z.push_back(static_cast<float>(p.z));
    cloud.nx.push_back(0), cloud.ny.push_back(0), cloud.nz.push_back(1);
  }
  probe.shell->bake.levels = 1;
  scene.bodies.push_back(probe);
  scene.hands.push_back(io::path_hand("probe", {{0, probe.pose}}));
  return scene;
}

h6Pose at(const h6Vec3& p) { return {p, {1, 0, 0, 0}}; }

// The probe goes from corner to corner in straight lines, `step` a frame [m].
std::optional<PopThrough> walk(const io::LoadedScene& loaded, const std::vector<h6Vec3>& corners,
                               double step = 0.1 * kMm) {
  ThroughWatch watch(loaded);
  h6FrameRecord r{};
  r.body[0].pose = at(corners[0]);
  const auto frame = [&] {
    r.time = 1e-3 * static_cast<double>(r.report.frame);
    watch.frame(r);
    ++r.report.frame;
  };
  frame();
  for (std::size_t k = 1; k < corners.size(); ++k) {
    const h6Vec3 way = corners[k] - corners[k - 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(norm(way) / step)));
    for (int i = 1; i <= steps; ++i) {
      r.body[0].pose = at(corners[k - 1] + (static_cast<double>(i) / steps) * way);
      frame();
    }
  }
  const PopThroughReport report = watch.judge();
  CHECK(report.left_out.empty());
  return report.first;
}

h6Vec3 mm(double x, double y, double z) { return kMm * h6Vec3{x, y, z}; }

}  // namespace

TEST_CASE("a point that goes through a sheet names the frame, the triangle and the place") {
  const Loaded l = load(probe_and(sheet(10 * kMm, 6)));
  // At 100 frames a 10 mm; (13, 4) lies in square 4 along x, 3 along y, right below its diagonal.
  const auto found = walk(*l, {mm(13, 2, 10), mm(13, 2, -10)});
  REQUIRE(found);
  CHECK(found->triangle == 2 * (3 * 6 + 4));
  CHECK(norm(found->place - mm(13, 2, 0)) < 1e-8);
  CHECK(found->body == "probe");
  CHECK(found->obstacle == "obstacle");
  CHECK(std::fabs(found->time - 0.100) < 0.010);  // within a voxel of the sheet
  CHECK(found->frame == static_cast<std::uint64_t>(std::lround(1000 * found->time)));
  CHECK(found->free_time > found->time);
  CHECK(found->free_time < 0.125);
  CHECK(sentence(*found).find("triangle 44 of 'obstacle'") != std::string::npos);
}

TEST_CASE("a single frame that jumps over a sheet is through as well") {
  const Loaded l = load(probe_and(sheet(10 * kMm, 6)));
  CHECK(walk(*l, {mm(1, 2, 10), mm(1, 2, -10)}, 100 * kMm));
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(25, 2, 10)}, 100 * kMm));
}

TEST_CASE("a point that comes back to its side of a sheet, or goes around it, is not through") {
  const Loaded l = load(probe_and(sheet(10 * kMm, 6)));
  // In its middle, and a little beyond, then back, and also far along the sheet.
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(1, 2, 0), mm(1, 2, 10)}));
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(1, 2, -0.8), mm(1, 2, 10)}));
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(1, 2, 0.1), mm(20, 12, 0.2), mm(20, 12, 10)}));
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(1, 2, -0.3), mm(9, 2, -0.3), mm(9, 2, 10)}));
  CHECK_FALSE(walk(*l, {mm(1, 2, 10), mm(40, 2, 10), mm(40, 2, -10), mm(1, 2, -10)}));
  // Around the border in contact: sheets are 0.9 voxel thick to each side.
  CHECK_FALSE(walk(*l, {mm(25, 2, 10), mm(25, 2, 0.7), mm(30.5, 2, 0.7), mm(30.5, 2, -0.7),
                        mm(25, 2, -0.7), mm(25, 2, -10)}));
}

TEST_CASE("a border may be cut by less than half a voxel") {
  const Loaded l = load(probe_and(sheet(10 * kMm, 6)));
  for (const double inside : {-0.5, -0.1, 0.0, 0.1, 0.3})
    CHECK_FALSE(walk(*l, {mm(30 - inside, 2, 10), mm(30 - inside, 2, -10)}));
  for (const double inside : {1.0, 2.0, 5.0})
    CHECK(walk(*l, {mm(30 - inside, 2, 10), mm(30 - inside, 2, -10)}));
}

TEST_CASE("a point that goes into a solid is through when it leaves by another side, not before") {
  const Loaded l = load(probe_and(io::box_mesh(mm(-20, -20, -20), mm(20, 20, 20))));
  CHECK_FALSE(walk(*l, {mm(1, 2, 30), mm(1, 2, 12), mm(1, 2, 30)}));                // out as in
  CHECK_FALSE(walk(*l, {mm(1, 2, 30), mm(1, 2, 17), mm(9, 9, 17), mm(9, 9, 30)}));  // elsewhere
  CHECK_FALSE(walk(*l, {mm(1, 2, 30), mm(1, 2, -12)}));                             // still in it
  CHECK(walk(*l, {mm(1, 2, 30), mm(1, 2, -30)}));
  CHECK(walk(*l, {mm(1, 2, 30), mm(1, 2, 3), mm(30, 2, 3)}));
}

TEST_CASE("a point that slides around a block in contact is not through") {
  const Loaded l = load(probe_and(io::box_mesh(mm(-20, -20, -20), mm(20, 20, 20))));
  for (const double depth : {0.05, 0.3, 0.5, 1.0}) {
    const double s = 20 - depth;
    CHECK_FALSE(walk(
        *l, {mm(3, 0, 30), mm(3, 0, s), mm(s, 0, s), mm(s, 0, -s), mm(-s, 0, -s), mm(-s, 0, -30)}));
    CAPTURE(depth);
    CHECK_FALSE(walk(*l, {mm(3, 0, 30), mm(3, 0, s), mm(s, s, s), mm(s, s, -s), mm(30, 30, -s)}));
  }
}

TEST_CASE("a point that stays within 0.4 voxel of a corner is not through, whatever its way") {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> share(0, 1);
  const auto near_corner = [&] {
    for (;;) {
      const h6Vec3 p = {2 * share(engine) - 1, 2 * share(engine) - 1, 2 * share(engine) - 1};
      if (norm(p) < 1) return 0.4 * kMm * p;
    }
  };
  for (int grid = 0; grid < 12; ++grid) {
    // A wedge with a sharp edge, like the tip of a tooth, anywhere on the lattice.
    const h6Vec3 corner = mm(20 + share(engine), 8 + share(engine), 6 + share(engine));
    io::Mesh wedge = io::box_mesh(mm(-20, -8, -6), corner);
    for (h6Vec3& v : wedge.vertices)
      if (v.x > 0 && v.y < 0) v.y = corner.y - 5 * kMm;
    const Loaded l = load(probe_and(std::move(wedge)));
    for (int way = 0; way < 20; ++way) {
      const auto free = [&] { return corner + mm(2 + share(engine), 2, 2 + share(engine)); };
      std::vector<h6Vec3> corners = {free()};
      for (int k = 0; k < 8; ++k) corners.push_back(corner + near_corner());
      corners.push_back(free());
      CHECK_FALSE(walk(*l, corners, 0.05 * kMm));
    }
  }
}

TEST_CASE("a point that starts inside is judged only after it has once been free") {
  const Loaded l = load(probe_and(io::box_mesh(mm(-20, -20, -20), mm(20, 20, 20))));
  CHECK_FALSE(walk(*l, {mm(1, 2, 18), mm(1, 2, 30)}));
  CHECK_FALSE(walk(*l, {mm(1, 2, 19.5), mm(15, 2, 19.5), mm(15, 2, 30)}));
  CHECK(walk(*l, {mm(1, 2, 19.5), mm(1, 2, 30), mm(1, 2, -30)}));
  // One that touches a sheet at the start is on a side of it.
  const Loaded thin = load(probe_and(sheet(10 * kMm, 6)));
  CHECK(walk(*thin, {mm(1, 2, 0.9), mm(1, 2, -10)}));
  CHECK_FALSE(walk(*thin, {mm(1, 2, 0.5), mm(1, 2, 10)}));
}

TEST_CASE("a point that starts in a tight fit and slides out over the edge is not through") {
  for (const double f : {0.0, 0.2, 0.4, 0.6, 0.8}) {  // the edge lies elsewhere in its cell
    const Loaded l = load(probe_and(io::box_mesh(mm(-20, -20, -20), mm(20 + f, 20, 20 + 2 * f))));
    for (const double depth : {0.02, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.6, 2.9}) {
      CAPTURE(f);
      CAPTURE(depth);
      const double x = 20 + f - depth;
      for (const double start : {10.0, 19.0, 19.7, 19.9})
        CHECK_FALSE(walk(*l, {mm(x, 2, start + 2 * f), mm(x, 2, 30)}));
      CHECK_FALSE(walk(*l, {mm(x, 2, 10), mm(x, 2, 20 + 2 * f - depth), mm(x + 10, 2, 30)}));
      CHECK(walk(*l, {mm(x, 2, 10), mm(x, 2, 30), mm(1, 2, 30), mm(1, 2, -30)}));  // once free
    }
  }
}

TEST_CASE("an obstacle that moves over a part that rests counts like a part that moves") {
  io::Scene scene = probe_and(sheet(10 * kMm, 6));
  scene.bodies[0].fixed = false;
  scene.bodies[0].com = h6Vec3{0, 0, 0};
  scene.bodies[0].inertia = io::box_inertia(0.1, {kMm, kMm, kMm});
  scene.hands.push_back(io::path_hand("obstacle", {{0, at({0, 0, 0})}}));
  const Loaded l = load(std::move(scene));
  const auto run = [&](double probe_end) {
    ThroughWatch watch(*l);
    h6FrameRecord r{};
    for (int i = 0; i <= 200; ++i) {
      r.report.frame = static_cast<std::uint64_t>(i), r.time = 1e-3 * i;
      const double s = i / 200.0;
      r.body[0].pose = at(mm(12 + 5 * s, 2, 10 + (probe_end - 10) * s));
      r.body[1].pose = {mm(5 * s, 0, 20 * s), turn_by({0, 0, 0.5 * s})};
      watch.frame(r);
    }
    return watch.judge().first;
  };
  const auto found = run(10);
  REQUIRE(found);
  // The place is where the sheet was then, in the world.
  CHECK(std::fabs(found->place.z - 10 * kMm) < kMm);
  CHECK(std::fabs(found->place.x - 14.5 * kMm) < kMm);
  CHECK_FALSE(run(30));  // it flees
}

TEST_CASE("what has no mesh, or moves by itself, is said not to have been judged") {
  io::Scene scene = probe_and(sheet(10 * kMm, 2));
  scene.hands.clear();
  const Loaded l = load(std::move(scene));
  const PopThroughReport report = ThroughWatch(*l).judge();
  REQUIRE(report.left_out.size() == 1);
  CHECK(report.left_out[0].find("'probe' moves without a hand") != std::string::npos);
}

TEST_CASE("straight ways among random triangles are through when they meet one") {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> side(-15, 15), pace(0.03, 3);
  const auto random = [&] { return mm(side(engine), side(engine), side(engine)); };
  // Where a line meets a triangle's plane, and how far inside all its edges: < 0 outside.
  const auto inside = [](const h6Vec3* c, const h6Vec3& a, const h6Vec3& b) {
    const h6Vec3 n = unit(cross(c[1] - c[0], c[2] - c[0]));
    const double from = dot(n, a - c[0]), to = dot(n, b - c[0]);
    if ((from < 0) == (to < 0)) return -1.0;
    const h6Vec3 x = a + (from / (from - to)) * (b - a);
    double least = 1;
    for (int k = 0; k < 3; ++k)
      least = std::min(least, dot(cross(n, unit(c[(k + 1) % 3] - c[k])), x - c[k]));
    return least;
  };
  int met = 0, free = 0;
  for (int trial = 0; trial < 6; ++trial) {
    io::Mesh mesh;
    for (std::uint32_t t = 0; t < 3; ++t) {
      for (int k = 0; k < 3; ++k) mesh.vertices.push_back(random());
      mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    const Loaded l = load(probe_and(mesh));
    for (int way = 0; way < 60; ++way) {
      // Both ends lie outside the cube of the triangles.
      const h6Vec3 middle = random(), along = unit(random());
      const h6Vec3 a = middle - 60 * kMm * along, b = middle + 60 * kMm * along;
      double deepest = -1;
      for (int t = 0; t < 3; ++t) deepest = std::max(deepest, inside(&mesh.vertices[3 * t], a, b));
      if (deepest >= 0 && deepest < 1.2 * kMm) continue;  // it cuts a border
      const auto found = walk(*l, {a, b}, pace(engine) * kMm);
      CHECK(found.has_value() == (deepest > 0));
      if (found) CHECK(inside(&mesh.vertices[3 * found->triangle], a, b) >= 0);
      (deepest > 0 ? met : free) += 1;
    }
  }
  CHECK(met > 30);
  CHECK(free > 30);
}

namespace {

// A box of 20 x 20 x 10 mm is pressed on a sheet of metal from above.
const io::LoadedScene& box_on_sheet() {
  static const Loaded loaded = [] {
    io::Scene scene = *io::make_scene("box-on-wall");
    scene.verdict = {};
    scene.bodies[0].field->mesh_data = sheet(10 * kMm, 8);
    const h6Pose start = scene.hands[0].path[0].pose;
    scene.hands[0].path = io::HandPath(start).move_by(mm(0, 0, -20), 0.05).wait(0.5).rows();
    return load(std::move(scene));
  }();
  return *loaded;
}

RunFigures run(const io::LoadedScene& loaded, const char* method, double force) {
  RunChange change;
  change.method = {method, method, 0};
  change.force = force;
  RunFigures out = run_experiment(loaded, change);
  CHECK(out.error == "");
  CHECK(out.through.left_out.empty());
  return out;
}

}  // namespace

TEST_CASE("a box that is forced through a sheet is through, and one that is held is held") {
  const RunFigures held = run(box_on_sheet(), "robust", 1);
  CHECK(held.verdict == io::Verdict::held);
  CHECK(!held.through.first);
  CHECK(held.left_behind.find("'box' ends ") == 0);
  CHECK(held.left_behind.find("contacts hold the part") != std::string::npos);

  const RunFigures forced = run(box_on_sheet(), "robust", 200);
  CHECK(forced.verdict == io::Verdict::through);
  REQUIRE(forced.through.first);
  const PopThrough& found = *forced.through.first;
  const h6Vec3 p = found.place;
  CHECK(std::fabs(p.z) < 1e-8);
  CHECK(std::max(std::fabs(p.x), std::fabs(p.y)) < 10.1 * kMm);
  // The triangle holds the place: squares of 10 mm from -40 mm on, cut along x = y.
  const double u = (p.x / kMm + 40) / 10, v = (p.y / kMm + 40) / 10;
  const auto square =
      static_cast<std::uint32_t>(std::floor(v)) * 8 + static_cast<std::uint32_t>(std::floor(u));
  CHECK(found.triangle / 2 == square);
  const double above = v - std::floor(v) - (u - std::floor(u));
  if (std::fabs(above) > 1e-6) CHECK(found.triangle % 2 == (above > 0));
}

TEST_CASE("a peg in a hole is never through, with any method") {
  const Loaded peg = load(*io::make_scene("peg-in-hole"));
  for (const char* method : {"none", "global", "robust", "gauss3", "series"}) {
    CAPTURE(method);
    CHECK(!run(*peg, method, 1).through.first);
  }
}

TEST_CASE("a run in which nothing touches is untouched") {
  io::Scene scene = *io::make_scene("box-on-wall");
  scene.hands[0].path = io::HandPath(scene.hands[0].path[0].pose).wait(0.3).rows();
  const RunFigures out = run(*load(std::move(scene)), "robust", 1);
  CHECK(out.verdict == io::Verdict::untouched);
  CHECK(out.left_behind.empty());
}
