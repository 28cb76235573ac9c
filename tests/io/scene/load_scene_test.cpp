// SPDX-License-Identifier: Apache-2.0
// Tests loading a scene: mass properties, shared assets, and error sentences that name the body.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "io/scene/load_scene.h"
#include "io/scene/mass.h"
#include "io/scenes/scenes.h"
#include "tests/io/private_cache.h"

using namespace h6;
using namespace h6::io;

namespace {

// A box with corners at +-half, moved by `at`, wound outward or inside out.
Mesh box(Vec3 half, Vec3 at, bool inside_out = false) {
  Mesh m;
  for (int i = 0; i < 8; ++i)
    m.vertices.push_back({at.x + (i & 1 ? half.x : -half.x), at.y + (i & 2 ? half.y : -half.y),
                          at.z + (i & 4 ? half.z : -half.z)});
  const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    m.triangles.push_back({q[0], q[1], q[2]});
    m.triangles.push_back({q[0], q[2], q[3]});
  }
  if (inside_out)
    for (auto& t : m.triangles) std::swap(t[1], t[2]);
  return m;
}

Scene two_boxes() {
  Scene scene;
  scene.name = "two boxes";
  scene.contact = h6DefaultContactDef();
  scene.coupling = h6DefaultCouplingDef();
  SceneBody wall, part;
  wall.name = "wall", wall.fixed = true, wall.pose.q.w = 1;
  wall.field.emplace();
  wall.field->mesh_data = box({0.02, 0.02, 0.005}, {0, 0, 0});
  wall.field->bake.voxels = 48;
  part.name = "part", part.pose = {{0, 0, 0.02}, {1, 0, 0, 0}};
  part.shell.emplace();
  part.shell->mesh_data = box({0.01, 0.01, 0.01}, {0.003, 0, 0});
  part.shell->bake.points = 500;
  scene.bodies = {wall, part};
  SceneHand hand;
  hand.body = "part";
  hand.path = {{0, part.pose}, {0.5, {{0, 0, 0.014}, {1, 0, 0, 0}}}};
  scene.hands = {hand};
  return scene;
}

}  // namespace

TEST_CASE(
    "a solid box has the inertia of the text book, wherever it lies and however it is wound") {
  for (const bool inside_out : {false, true}) {
    const auto m = solid_mass(box({0.01, 0.02, 0.03}, {5, -3, 2}, inside_out), 0.6);
    REQUIRE(m);
    CHECK(m->com.x == h6::test::near(5));
    CHECK(m->com.y == h6::test::near(-3));
    CHECK(m->inertia[0] == h6::test::near(0.6 / 3 * (0.02 * 0.02 + 0.03 * 0.03)).epsilon(1e-6));
    CHECK(m->inertia[1] == h6::test::near(0.6 / 3 * (0.01 * 0.01 + 0.03 * 0.03)).epsilon(1e-6));
    CHECK(m->inertia[2] == h6::test::near(0.6 / 3 * (0.01 * 0.01 + 0.02 * 0.02)).epsilon(1e-6));
    for (int k = 3; k < 6; ++k) CHECK(std::fabs(m->inertia[k]) < 1e-12);
  }
}

TEST_CASE("what is no solid has no solid mass: open, mixed winding, doubled, flat") {
  Mesh open = box({1, 1, 1}, {0, 0, 0});
  open.triangles.pop_back();
  CHECK(!solid_mass(open, 1));
  Mesh mixed = box({1, 1, 1}, {0, 0, 0});
  std::swap(mixed.triangles[3][1], mixed.triangles[3][2]);
  CHECK(!solid_mass(mixed, 1));
  Mesh doubled = box({1, 1, 1}, {0, 0, 0});
  doubled.triangles.insert(doubled.triangles.end(), doubled.triangles.begin(),
                           doubled.triangles.end());
  CHECK(!solid_mass(doubled, 1));
  CHECK(!solid_mass(box({1, 1, 0}, {0, 0, 0}), 1));
  CHECK(!solid_mass({}, 1));
}

TEST_CASE("a scene becomes a model, bodies and hands that a session takes") {
  auto loaded = load_scene(two_boxes());
  REQUIRE_MESSAGE(loaded, loaded.error());
  const LoadedScene& l = **loaded;
  CHECK(l.bodies[1].com.x == h6::test::near(0.003));
  CHECK(l.bodies[1].inertia[2] == h6::test::near(0.1 / 3 * 2e-4).epsilon(1e-6));
  CHECK(l.watched_points().size() == 500);
  CHECK(l.duration() == h6::test::near(0.5));
  CHECK(l.assets.size() == 2);
  const h6SessionDef def = l.session_def();
  h6Error error{};
  h6Session* session = h6CreateSession(l.model.get(), &def, &error);
  REQUIRE_MESSAGE(session, error.message);
  h6DeviceSample sample{};
  sample.pose = {{0, 0, 0.0145}, {1, 0, 0, 0}};
  for (int i = 0; i < 1000; ++i) h6Step(session, &sample, nullptr);
  // A box of half height 10 mm is pushed 0.5 mm into a wall whose top is at 5 mm.
  CHECK(h6GetFrame(session).contacts > 20);
  CHECK(h6GetBody(session, 1).pose.p.z == h6::test::near(0.015).epsilon(0.01));
  h6DestroySession(session);
}

TEST_CASE("bodies with the same content share one asset, and a second load comes from the cache") {
  Scene scene = two_boxes();
  SceneBody twin = scene.bodies[0];
  twin.name = "second wall";
  twin.pose.p.x = 1;
  scene.bodies.push_back(twin);
  auto first = load_scene(scene);
  REQUIRE(first);
  CHECK((*first)->bodies[0].field == (*first)->bodies[2].field);
  CHECK((*first)->assets.size() == 2);
  auto second = load_scene(scene);
  REQUIRE(second);
  for (const LoadedAsset& a : (*second)->assets) CHECK(a.from_cache);
  twin.field->bake.voxels = 32;  // other options of a bake give another asset
  scene.bodies[2] = twin;
  auto third = load_scene(scene);
  REQUIRE(third);
  CHECK((*third)->bodies[0].field != (*third)->bodies[2].field);
}

TEST_CASE("what the scene states wins over what could be derived") {
  Scene scene = two_boxes();
  scene.bodies[1].com = h6Vec3{0, 0, 0.004};
  auto loaded = load_scene(scene);
  REQUIRE(loaded);
  CHECK((*loaded)->bodies[1].com.z == 0.004);
  // The inertia is then about the stated centre (parallel axis theorem).
  CHECK((*loaded)->bodies[1].inertia[2] ==
        h6::test::near(0.1 / 3 * 2e-4 + 0.1 * 9e-6).epsilon(1e-6));
  scene.bodies[1].inertia = std::array<double, 6>{1e-5, 2e-5, 3e-5, 0, 0, 0};
  loaded = load_scene(scene);
  REQUIRE(loaded);
  CHECK((*loaded)->bodies[1].inertia[1] == 2e-5);
}

TEST_CASE("what a scene says of hands, bodies and telemetry reaches the session's definition") {
  Scene scene = two_boxes();
  scene.bodies[1].translation_only = true;
  scene.coupling.mode = H6_COUPLING_STATIC;
  scene.contact.passivity = true;
  scene.net_stiffness = true;
  scene.max_substeps = 3;
  h6HandDef& hand = scene.hands[0].def;
  hand.mode = H6_PSEUDO_ADMITTANCE;
  hand.filter.motion_scale = 2, hand.filter.clutch_buttons = 4;
  hand.driver_stiffness = 700;
  hand.passivity = true;
  auto loaded = load_scene(scene);
  REQUIRE_MESSAGE(loaded, loaded.error());
  const h6SessionDef def = (*loaded)->session_def();
  CHECK(def.net_stiffness);
  CHECK(def.max_substeps == 3);
  CHECK(def.contact.passivity);
  CHECK(def.bodies[1].translation_only);
  CHECK(!def.bodies[0].translation_only);
  CHECK(def.hands[0].body == 1);
  CHECK(def.hands[0].coupling.mode == H6_COUPLING_STATIC);
  CHECK(def.hands[0].mode == H6_PSEUDO_ADMITTANCE);
  CHECK(def.hands[0].filter.motion_scale == 2);
  CHECK(def.hands[0].filter.clutch_buttons == 4);
  CHECK(def.hands[0].driver_stiffness == 700);
  CHECK(def.hands[0].manipulandum_mass == h6DefaultHandDef().manipulandum_mass);
  CHECK(def.hands[0].passivity);
}

TEST_CASE("trouble with a body's files names the body and the file") {
  Scene scene = two_boxes();
  scene.bodies[1].shell->mesh_data.reset();
  scene.bodies[1].shell->mesh = "no-such-part.stl";
  auto loaded = load_scene(scene);
  REQUIRE(!loaded);
  CHECK(loaded.error().find("part") != std::string::npos);
  CHECK(loaded.error().find("no-such-part.stl") != std::string::npos);
}

TEST_CASE("a user who interrupts gets a sentence, not half a model") {
  Scene scene = two_boxes();
  scene.bodies[0].field->bake.voxels = 200;
  const auto loaded = load_scene(scene, [](const std::string&, double) { return false; });
  REQUIRE(!loaded);
  CHECK(loaded.error().find("cancel") != std::string::npos);
}
