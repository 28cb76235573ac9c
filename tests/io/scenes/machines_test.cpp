// SPDX-License-Identifier: Apache-2.0
// machines_test.cpp - the generated machines: fits, clearances and paths.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "io/mesh/ray_scene.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

using namespace h6;
using namespace h6::io;

namespace {

const std::vector<std::string>& machines() {
  static const std::vector<std::string> names = {"piston-in-bore", "gear-train", "nut-on-bolt",
                                                 "wire-bundle", "spline-hub-1k"};
  return names;
}

Scene made(const std::string& name) {
  Result<Scene> scene = make_scene(name);
  REQUIRE_MESSAGE(scene, scene.error());
  return *scene;
}

const SceneBody& part_of(const Scene& scene) { return scene.bodies.back(); }

// How near corners of one mesh come to the triangles of the other, 0 where a corner of the part is
// inside the obstacle.
double clearance(const Mesh& part, const Mesh& obstacle) {
  const auto around = RayScene::make(obstacle), within = RayScene::make(part);
  REQUIRE((around && within));
  double least = 1;
  std::vector<Crossing> crossings;
  for (const Vec3& p : part.vertices) {
    crossings.clear();
    (*around)->crossings(p, unit(Vec3{0.31, 0.52, 0.79}), crossings);
    if (crossings.size() % 2 == 1) return 0;
    least = std::min(least, (*around)->distance(p));
  }
  for (const Vec3& p : obstacle.vertices) least = std::min(least, (*within)->distance(p));
  return least;
}

double clearance(const Scene& scene, const h6Pose& pose) {
  const Mesh part = moved(*part_of(scene).shell->mesh_data, pose);
  double least = 1;
  for (const SceneBody& body : scene.bodies)
    if (body.field)
      least = std::min(least, clearance(part, moved(*body.field->mesh_data, body.pose)));
  return least;
}

}  // namespace

TEST_CASE("obstacles of machines are closed, and their parts start and end clear of them") {
  for (const std::string& name : machines()) {
    CAPTURE(name);
    const Scene scene = made(name);
    for (const SceneBody& body : scene.bodies)
      if (body.field) CHECK(audit(*body.field->mesh_data).closed);
    const Path& path = scene.hands[0].path;
    CHECK(norm(path.front().pose.p - part_of(scene).pose.p) == 0);
    CHECK(norm(path.back().pose.p - part_of(scene).pose.p) < 1e-9);
    CHECK(clearance(scene, path.front().pose) > 1 * kMm);
  }
}

TEST_CASE("the hand alone would go through every machine: each scene can touch") {
  for (const std::string& name : machines()) {
    CAPTURE(name);
    const Scene scene = made(name);
    bool crossed = false;
    for (const PathRow& row : scene.hands[0].path)
      crossed = crossed || clearance(scene, row.pose) == 0;
    CHECK(crossed);
  }
}

TEST_CASE("the shaft has a quarter of a voxel of play in its hub, and none once it is turned") {
  const Scene scene = made("spline-hub-1k");
  const double play = 0.25 * scene.bodies[0].field->bake.voxel_size;
  const h6Pose seat = {{0, 0, 0}, {1, 0, 0, 0}};
  const double gap = clearance(scene, seat);
  CHECK(gap < 1.05 * play);
  CHECK(gap > 0.8 * play);  // chords of arcs come a little nearer
  CHECK(clearance(scene, {{0, 0, 0}, turn_by({0, 0, 0.004})}) == 0);
}

TEST_CASE("the three hubs differ in the number of points only") {
  const Scene few = made("spline-hub-1k"), some = made("spline-hub-10k"),
              many = made("spline-hub-100k");
  CHECK(part_of(some).shell->bake.points == 10 * part_of(few).shell->bake.points);
  CHECK(part_of(many).shell->bake.points == 100 * part_of(few).shell->bake.points);
  CHECK(some.bodies[0].field->mesh_data->vertices.size() ==
        many.bodies[0].field->mesh_data->vertices.size());
}

TEST_CASE("the gears mesh with play where the idler comes to stand") {
  const Scene scene = made("gear-train");
  const h6Pose meshed = {{0, 0, 0}, part_of(scene).pose.q};
  CHECK(clearance(scene, meshed) > 0.15 * kMm);
  CHECK(clearance(scene, {{0, 0, 0}, product(turn_by({0, 0, 0.15}), meshed.q)}) == 0);
}

TEST_CASE("the thread lets the nut down as it turns, and by no other way") {
  const Scene scene = made("nut-on-bolt");
  const auto nut_at = [&](double mm, double turns) {
    return clearance(scene, {{0, 0, mm * kMm}, turn_by({0, 0, 2 * std::numbers::pi * turns})});
  };
  CHECK(nut_at(0, 0) > 0.05 * kMm);  // its thread is in line with the bolt's at every whole turn
  CHECK(nut_at(-6, -1.5) > 0.05 * kMm);
  CHECK(nut_at(-6, -1) == 0);
  CHECK(nut_at(-6, 1.5) > 0.05 * kMm);  // half a turn is half a turn
  CHECK(nut_at(-5, 1.25) == 0);         // but a left-handed one does not fit
  CHECK(nut_at(-5, -1.25) > 0.05 * kMm);
}

TEST_CASE("each hand of the alphas goes half of the way of alpha-shortcut") {
  const Scene both = made("alphas-in-two-hands"), one = made("alpha-shortcut");
  REQUIRE(both.hands.size() == 2);
  CHECK(!both.bodies[0].fixed);
  const Path &right = both.hands[0].path, &left = both.hands[1].path;
  REQUIRE(right.size() == left.size());
  for (std::size_t i = 0; i < right.size(); ++i) {
    const h6Vec3 between = right[i].pose.p - left[i].pose.p;
    REQUIRE(norm(between - one.hands[0].path[i].pose.p) < 1e-12);
  }
}
