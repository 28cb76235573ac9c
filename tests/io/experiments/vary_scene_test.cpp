// SPDX-License-Identifier: Apache-2.0
// vary_scene_test.cpp - variations of generated scenes: what is drawn, and what a scene becomes.
#include "io/experiments/vary_scene.h"

#include <doctest/doctest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "io/scene/load_scene.h"
#include "io/scenes/scenes.h"

using namespace h6;
using namespace h6::cli;

namespace {

io::Scene varied(const std::string& name, const Variation& v) {
  Result<io::Scene> scene = vary(name, v);
  REQUIRE_MESSAGE(scene, scene.error());
  return *scene;
}

const std::string kScene = "box-over-wire";

}  // namespace

TEST_CASE("a seed gives one variation; two kinds agree in what both change") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Variation all = draw_variation(Vary::all, seed), again = draw_variation(Vary::all, seed);
    CHECK(all.voxel == again.voxel);
    CHECK(all.sampling.seed == again.sampling.seed);
    const Variation turned = draw_variation(Vary::turn, seed);
    CHECK(turned.turn.x == all.turn.x);
    CHECK(turned.push == all.push);
    CHECK(turned.mass == 1);
    CHECK(all.voxel != draw_variation(Vary::all, seed + 1).voxel);
  }
}

TEST_CASE("drawn values fill their ranges and do not leave them") {
  double low = 9, high = 0, mean_w2 = 0;
  constexpr int kMany = 2000;
  for (std::uint64_t seed = 0; seed < kMany; ++seed) {
    const Variation v = draw_variation(Vary::all, seed);
    low = std::min(low, v.push), high = std::max(high, v.push);
    CHECK(v.push >= 1.5);
    CHECK(v.push < 8);
    CHECK(v.voxel >= 0.5);
    CHECK(v.voxel < 1.25);
    CHECK(v.sampling.jitter < 0.4);
    for (const double s : {v.shift.x, v.shift.y, v.shift.z}) CHECK(std::abs(s) <= 0.5);
    CHECK(std::abs(dot(v.turn, v.turn) - 1) < 1e-12);
    mean_w2 += v.turn.w * v.turn.w / kMany;
  }
  CHECK(low < 1.53);
  CHECK(high > 7.9);
  CHECK(std::abs(mean_w2 - 0.25) < 0.02);  // rotations are uniform: each of w, x, y, z alike
}

TEST_CASE("a series has every kind, and its seeds differ by scene and place") {
  std::set<Vary> kinds;
  std::set<std::uint64_t> seeds;
  for (std::size_t i = 0; i < 16; ++i) {
    kinds.insert(kind_in_series(i));
    for (const char* scene : {"a", "b"}) seeds.insert(seed_in_series(1, scene, i));
    seeds.insert(seed_in_series(2, "a", i));
  }
  CHECK(kinds.size() == kVaryCount);
  CHECK(seeds.size() == 48);
}

TEST_CASE("every factor reaches its place in the scene") {
  const io::Scene plain = varied(kScene, {});
  Variation v;
  v.mass = 2, v.step = 2, v.voxel = 0.5, v.speed = 2;
  const io::Scene scene = varied(kScene, v);
  CHECK(scene.rate == 500);
  CHECK(scene.bodies.back().mass == 2 * plain.bodies.back().mass);
  CHECK((*scene.bodies.back().inertia)[0] == 2 * (*plain.bodies.back().inertia)[0]);
  CHECK(smallest_voxel(scene) == doctest::Approx(0.5 * smallest_voxel(plain)));
  // The voxel is another one, the force is not.
  CHECK(largest_force(plain) == doctest::Approx(5));
  CHECK(largest_force(scene) == doctest::Approx(5));
  // The path is the same; it moves twice as fast and rests as long.
  const io::Path &a = plain.hands[0].path, &b = scene.hands[0].path;
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 1; i < a.size(); ++i) {
    const bool rests = norm(a[i].pose.p - a[i - 1].pose.p) == 0;
    CHECK(b[i].t - b[i - 1].t == doctest::Approx((a[i].t - a[i - 1].t) / (rests ? 1 : 2)));
    CHECK(norm(b[i].pose.p - a[i].pose.p) == 0);
  }
}

TEST_CASE("a field with a tolerance is varied in its tolerance, and its force stays") {
  const io::Scene plain = varied("box-over-fused-wire", {});
  Variation v = draw_variation(Vary::turn, 3);
  v.voxel = 0.5, v.shift = {0.5, 0, 0};
  const io::Scene scene = varied("box-over-fused-wire", v);
  const io::FieldBake &a = plain.bodies[0].field->bake, &b = scene.bodies[0].field->bake;
  CHECK(a.tolerance > 0);
  CHECK(b.tolerance == 0.5 * a.tolerance);
  CHECK(b.voxel_size == 0);
  CHECK(smallest_voxel(plain) == io::kFinest * a.tolerance);
  CHECK(largest_force(plain) == 5);
  CHECK(largest_force(scene) == 5);
  const auto loaded = io::load_scene(io::Scene(scene));
  REQUIRE_MESSAGE(loaded, loaded.error());
  // Its coarse voxels are cut into four.
  CHECK((*loaded)->assets[0].voxel_size == doctest::Approx(4 * smallest_voxel(scene)));
}

TEST_CASE("a lattice that turns and shifts leaves the obstacle where it is, with other samples") {
  Variation v = draw_variation(Vary::turn, 3);
  v.shift = {0.5, 0.25, -0.25};
  const auto plain = io::load_scene(varied("box-on-wall", {}));
  const auto moved = io::load_scene(varied("box-on-wall", v));
  REQUIRE_MESSAGE(moved, moved.error());
  const h6Quat back = conjugate((*moved)->bodies[0].pose.q);
  for (const h6Vec3 p : {h6Vec3{0, 0, 1.3e-3}, h6Vec3{0.01, -0.005, -0.7e-3}}) {  // in the world
    const h6Vec3 q = rotate(back, p);
    double a = 0, b = 0;
    REQUIRE(h6SampleField((*plain)->model.get(), 0, &p.x, 1, &a, nullptr, nullptr) == 0);
    REQUIRE(h6SampleField((*moved)->model.get(), 0, &q.x, 1, &b, nullptr, nullptr) == 0);
    CHECK(a == doctest::Approx(p.z));
    CHECK(b == doctest::Approx(p.z).epsilon(1e-4));  // trilinear samples of a plane are exact
  }
  v.turn = {1, 0, 0, 0};
  const auto shifted = io::load_scene(varied("box-on-wall", v));
  const h6Vec3 a = (*plain)->assets[0].origin, b = (*shifted)->assets[0].origin;
  const auto lattice = [](double x) { return x / 1e-3 - std::floor(x / 1e-3); };  // place in a cell
  const auto apart = [&](double x, double y) { return lattice(x - y + 1e-9); };
  CHECK(apart(b.x, a.x) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(apart(b.y, a.y) == doctest::Approx(0.25).epsilon(1e-3));
  CHECK(apart(b.z, a.z) == doctest::Approx(0.75).epsilon(1e-3));
}

TEST_CASE("every scene with a forbidden region can be varied in every way") {
  for (const io::SceneName& entry : io::scene_names()) {
    if (entry.name == "engine-bay" || entry.name == "landing-gear") continue;  // slow to make
    CAPTURE(entry.name);
    const Result<io::Scene> plain = io::make_scene(entry.name);
    if (plain->verdict.forbidden.empty()) continue;
    const Result<io::Scene> scene = vary(entry.name, draw_variation(Vary::all, 7));
    CHECK_MESSAGE(scene, scene.error());
    CHECK(scene->generated == entry.name);
    for (const io::SceneBody& body : scene->bodies)
      if (body.field) CHECK_FALSE(body.field->keep);
  }
}
