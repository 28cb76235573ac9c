// SPDX-License-Identifier: Apache-2.0
// bends_test.cpp - scenes with a shell that bends: read, refused, run, written.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include "io/deform/deformable_file.h"
#include "io/deform/solid_file.h"
#include "io/mesh/mesh_file.h"
#include "io/scene/load_scene.h"
#include "io/scenes/shapes.h"
#include "tests/io/deform/solids.h"
#include "tests/io/private_cache.h"
#include "tests/io/scene/scene_samples.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr h6Vec3 kBeam{0.2, 0.03, 0.01};  // fixed at x = 0 [m]

ReducedModel beam(const h6Vec3& size, bool fixed = true, bool warp = false) {
  SolidMesh solid = solids::block(size, {20, 3, 2}, {"rubber", 1e6, 0.4, 1000});
  if (fixed) fix_box(solid, {0, 0, 0}, {0, size.y, size.z});
  ReduceOptions options;
  options.modes = 6, options.free = !fixed, options.warp = warp;
  Result<ReducedModel> model = reduce(solid, options);
  REQUIRE_MESSAGE(model, model.error());
  return std::move(*model);
}

// A beam, and a ball's box over its free end that a hand presses down by 20 mm.
struct BeamBench {
  Folder folder;
  Json json;
  BeamBench() {
    REQUIRE(write_stl(folder.path / "beam.stl", box_mesh({0, 0, 0}, kBeam), Unit::mm));
    REQUIRE(write_stl(folder.path / "tool.stl", box_mesh({-0.01, -0.01, 0}, {0.01, 0.01, 0.02}),
                      Unit::mm));
    REQUIRE(write_deformable(folder.path / "beam.h5", beam(kBeam)));
    folder.write("hand.csv",
                 "t,x,y,z,qw,qx,qy,qz\n0,180,15,11,1,0,0,0\n0.3,180,15,-9,1,0,0,0\n1,180,15,-9,1,"
                 "0,0,0\n");
    json = Json::parse(R"({"hapsix": 1, "units": "mm", "contact": {"stiffness": 1e4},
      "coupling": {"stiffness": 1000},
      "bodies": [
        {"name": "beam", "fixed": true,
         "shell": {"mesh": "beam.stl", "points": 4000, "bends": "beam.h5"}},
        {"name": "tool", "mass": 0.1, "pose": {"p": [180, 15, 11], "q": [1, 0, 0, 0]},
         "field": {"mesh": "tool.stl", "voxel_size": 0.5}}],
      "hands": [{"body": "tool", "path": "hand.csv"}]})");
  }
  Result<Scene> read() const { return read_scene(folder.write("scene.json", json.dump())); }
  std::string refused() const {
    const Result<Scene> scene = read();
    if (!scene) return scene.error();
    const auto loaded = load_scene(*scene);
    return loaded ? "" : loaded.error();
  }
};

// Steps along the hand's path, and returns the session.
struct Run {
  std::unique_ptr<LoadedScene> loaded;
  h6Session* session = nullptr;
  explicit Run(const Scene& scene) {
    auto made = load_scene(scene);
    REQUIRE_MESSAGE(made, made.error());
    loaded = std::move(*made);
    h6Error error{};
    const h6SessionDef def = loaded->session_def();
    session = h6CreateSession(loaded->model.get(), &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  Run(const Run&) = delete;
  ~Run() { h6DestroySession(session); }
  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      h6DeviceSample sample = h6DefaultDeviceSample();
      const double t = 1e-3 * ++frame;
      sample.pose = sample_path(loaded->scene.hands[0].path, t);
      sample.velocity = sample_path_velocity(loaded->scene.hands[0].path, t);
      h6Step(session, &sample, nullptr);
    }
  }
  int frame = 0;
};

}  // namespace

TEST_CASE("a beam of a scene file bends under the part that a hand presses on its end") {
  const BeamBench bench;
  const Result<Scene> scene = bench.read();
  REQUIRE_MESSAGE(scene, scene.error());
  Run run(*scene);
  REQUIRE(run.loaded->bends.size() == 2);
  REQUIRE(run.loaded->bends[0]);
  CHECK_FALSE(run.loaded->bends[1]);
  run.frames(1000);
  double q[H6_MAX_MODES];
  REQUIRE(h6GetDeformation(run.session, 0, q, nullptr, H6_MAX_MODES) == 6);
  // The beam's top under the tool, by the modes, is where the tool's bottom is.
  const auto modes = modes_at(*run.loaded->bends[0], {{0.18, 0.015, kBeam.z}});
  double down = 0;
  for (std::size_t j = 0; j < 6; ++j) down += q[j] * modes[3 * j + 2];
  CHECK(down < -5e-3);
  const h6BodyState tool = h6GetBody(run.session, 1);
  CHECK(kBeam.z + down == h6::test::near(tool.pose.p.z).epsilon(0.15));
}

TEST_CASE("a scene reads a warped beam, whose turns its asset's hash knows") {
  const BeamBench bench;
  ReducedModel model = beam(kBeam, true, true);
  std::string hashes[2];
  for (std::string& hash : hashes) {
    REQUIRE(write_deformable(bench.folder.path / "beam.h5", model));
    const Result<Scene> scene = bench.read();
    REQUIRE_MESSAGE(scene, scene.error());
    Run run(*scene);
    for (const LoadedAsset& asset : run.loaded->assets) hash += asset.hash;
    run.frames(500);
    double q[H6_MAX_MODES];
    REQUIRE(h6GetDeformation(run.session, 0, q, nullptr, H6_MAX_MODES) == 6);
    CHECK(std::fabs(q[0]) > 1e-5);
    for (double& turn : model.turn) turn *= 1.01;
  }
  CHECK(hashes[0] != hashes[1]);
}

TEST_CASE("a scene with a shell that bends, written and read, runs to the same bits") {
  const BeamBench bench;
  const Result<Scene> scene = bench.read();
  REQUIRE_MESSAGE(scene, scene.error());
  REQUIRE(export_scene(*scene, bench.folder.path / "out"));
  const Result<Scene> back = read_scene(bench.folder.path / "out" / "scene.json");
  REQUIRE_MESSAGE(back, back.error());
  Run a(*scene), b(*back);
  a.frames(400), b.frames(400);
  double p[6], q[6];
  REQUIRE(h6GetDeformation(a.session, 0, p, nullptr, 6) == 6);
  REQUIRE(h6GetDeformation(b.session, 0, q, nullptr, 6) == 6);
  for (int j = 0; j < 6; ++j) CHECK(p[j] == q[j]);
  CHECK(a.loaded->assets[0].hash == b.loaded->assets[0].hash);
}

TEST_CASE("a solid of a generated scene is reduced once, then taken from the cache") {
  const BeamBench bench;
  Scene scene = *bench.read();
  BendSource& bends = *scene.bodies[0].shell->bends;
  bends.file.clear();
  bends.solid = solids::block(kBeam, {20, 3, 2}, {"rubber", 2e6, 0.4, 1000});
  fix_box(*bends.solid, {0, 0, 0}, {0, kBeam.y, kBeam.z});
  bends.reduce.modes = 5;
  const Run first(scene), second(scene);
  CHECK(first.loaded->assets[0].modes == 5);
  CHECK(first.loaded->assets[0].hash == second.loaded->assets[0].hash);
  CHECK(first.loaded->bends[0]->basis == second.loaded->bends[0]->basis);
}

TEST_CASE("two bodies of one mesh, one of which bends, do not share their shell") {
  BeamBench bench;
  Json rigid = bench.json["bodies"][0];
  rigid["name"] = "rigid", rigid["shell"].erase("bends");
  rigid["pose"] = {{"p", {0, 100, 0}}, {"q", {1, 0, 0, 0}}};
  bench.json["bodies"].push_back(rigid);
  const Run run(*bench.read());
  CHECK(run.loaded->bodies[0].shell != run.loaded->bodies[2].shell);
  double q[6];
  CHECK(h6GetDeformation(run.session, 0, q, nullptr, 6) == 6);
  CHECK(h6GetDeformation(run.session, 2, q, nullptr, 6) == 0);
}

TEST_CASE("a body that cannot bend as the scene says is refused in one sentence") {
  const auto says = [](const BeamBench& bench, const std::string& word) {
    const std::string said = bench.refused();
    CHECK_MESSAGE(said.find(word) != std::string::npos, said);
    CHECK(said.find('\n') == std::string::npos);
  };
  BeamBench moving;
  moving.json["bodies"][0]["fixed"] = false;
  says(moving, "fixed");
  BeamBench both;
  both.json["bodies"][0]["field"] = {{"mesh", "beam.stl"}, {"voxel_size", 0.5}};
  says(both, "field");
  BeamBench missing;
  missing.json["bodies"][0]["shell"]["bends"] = "other.h5";
  says(missing, "other.h5");
  BeamBench outside;
  outside.json["bodies"][0]["shell"]["bends"] = "../beam.h5";
  says(outside, "outside the folder");
  const BeamBench garbage;
  garbage.folder.write("beam.h5", "no model");
  says(garbage, "beam.h5");
  const BeamBench free;
  REQUIRE(write_deformable(free.folder.path / "beam.h5", beam(kBeam, false)));
  says(free, "fixed nowhere");
  const BeamBench elsewhere;
  REQUIRE(write_stl(elsewhere.folder.path / "beam.stl",
                    box_mesh({1, 0, 0}, h6Vec3{1, 0, 0} + kBeam), Unit::mm));
  says(elsewhere, "outside its elements");
  const BeamBench near;  // the mesh stands out of the model by 30 mm
  REQUIRE(write_stl(near.folder.path / "beam.stl", box_mesh({0, 0, 0}, kBeam + h6Vec3{0.03, 0, 0}),
                    Unit::mm));
  const auto loaded = load_scene(*near.read());
  REQUIRE_MESSAGE(loaded, loaded.error());
  REQUIRE((*loaded)->warnings.size() == 1);
  CHECK((*loaded)->warnings[0].find("outside its elements") != std::string::npos);
}

TEST_CASE(
    "a real bridge of hexahedra carries a box that is dragged on it, less than half a voxel deep") {
  const char* given = std::getenv("HAPSIX_TEST_DATA");
  const fs::path data = fs::path(given ? given : "") / "deformable";
  if (!given || !fs::exists(data)) {
    MESSAGE("skipped: no real models");
    return;
  }
  const Folder folder;
  Result<SolidMesh> solid = read_solid(data / "simpleBridge.veg", Unit::m);
  REQUIRE_MESSAGE(solid, solid.error());
  fix_box(*solid, {-11, -1, -2}, {-9.4, 4, 2}), fix_box(*solid, {9.4, -1, -2}, {11, 4, 2});
  ReduceOptions options;
  options.modes = 10;
  const Result<ReducedModel> model = reduce(*solid, options);
  REQUIRE_MESSAGE(model, model.error());
  REQUIRE(write_deformable(folder.path / "bridge.h5", *model));
  REQUIRE(write_stl(folder.path / "box.stl", box_mesh({-0.6, 0, -0.6}, {0.6, 1, 0.6}), Unit::m));
  fs::copy_file(data / "simpleBridge.obj", folder.path / "bridge.obj");
  folder.write("hand.csv",
               "t,x,y,z,qw,qx,qy,qz\n0,0,0.3,0,1,0,0,0\n1,0,-0.6,0,1,0,0,0\n2,1,-0.6,0,1,0,0,0\n");
  const Result<Scene> scene = read_scene(folder.write("scene.json", R"({"hapsix": 1, "units": "m",
    "contact": {"stiffness": 1e4},
    "coupling": {"stiffness": 1000, "max_depth_voxels": 0.5},
    "bodies": [
      {"name": "bridge", "fixed": true,
       "shell": {"mesh": "bridge.obj", "points": 20000, "bends": "bridge.h5"}},
      {"name": "box", "mass": 5, "pose": {"p": [0, 0.3, 0], "q": [1, 0, 0, 0]},
       "field": {"mesh": "box.stl", "voxel_size": 0.02}}],
    "hands": [{"body": "box", "path": "hand.csv"}]})"));
  REQUIRE_MESSAGE(scene, scene.error());
  Run run(*scene);
  int touched = 0;
  double deepest = 0;
  for (int i = 0; i < 2000; ++i) {
    run.frames(1);
    const h6FrameReport report = h6GetFrame(run.session);
    touched += report.contacts > 0;
    if (i >= 1300)  // the box has landed and is dragged
      deepest = std::max<double>(deepest, report.max_depth_voxels);
  }
  CHECK(touched > 1000);
  CHECK(deepest < 0.5);
  double q[H6_MAX_MODES];
  REQUIRE(h6GetDeformation(run.session, 0, q, nullptr, H6_MAX_MODES) == 10);
  const auto modes = modes_at(*run.loaded->bends[0], {{1, 0.1, 0}});
  double down = 0;
  for (std::size_t j = 0; j < 10; ++j) down += q[j] * modes[3 * j + 1];
  MESSAGE("the bridge gives way by " << -1e3 * down << " mm");
  CHECK(down < 0);
}
