// SPDX-License-Identifier: Apache-2.0
// hapsix new: from meshes to a scene that touches. The scene is run as `run` runs it.
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

std::vector<Facet> box_between(const Corner& low, const Corner& high) {
  std::vector<Facet> facets = box_facets(1);
  for (Facet& facet : facets)
    for (Corner& c : facet)
      for (std::size_t k = 0; k < 3; ++k) c[k] = low[k] + c[k] * (high[k] - low[k]);
  return facets;
}

std::vector<Facet> both(std::vector<Facet> a, const std::vector<Facet>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Json new_scene(Sandbox& box, Args args) {
  args.insert(args.begin(), {"new", "--no-view"});
  return result_of(box, args);
}

// What must hold for every new scene: its start does not overlap, unless it says that it keeps a
// fit, the part touches, and what touches holds.
Json check_runs(Sandbox& box, const Json& made, const std::string& file = "scene.json") {
  const Json scene = Json::parse(slurp(box.file(file)), nullptr, false);
  REQUIRE(scene.is_object());
  CAPTURE(scene.dump(2));
  const Json ran = result_of(box, {"run", file, "--virtual-time"});
  CAPTURE(ran.dump(2));
  if (!made["start"]["overlaps"].get<bool>()) CHECK(ran["start_overlap"].empty());
  CHECK(ran["contacts"]["max"] > 0);
  CHECK(ran["verdict"] == "held");
  CHECK(ran["max_depth_voxels"] < 1);
  CHECK(made["trial"]["verdict"] == ran["verdict"]);
  CHECK(made["doubt"].is_null());
  CHECK(made["trial"]["contacts_max"] == ran["contacts"]["max"]);
  return scene;
}

std::string choice(const Json& made, const std::string& about) {
  for (const Json& c : made["choices"])
    if (c["about"] == about) return c["text"];
  return "";
}

}  // namespace

TEST_CASE("two meshes apart: the part starts near the other, free, and touches it") {
  Sandbox box;
  spill(box.file("part.stl"), stl(box_between({0, 0, 500}, {20, 20, 520})));
  spill(box.file("floor.stl"), stl(box_between({-50, -50, -20}, {50, 50, 0})));
  const Json made = new_scene(box, {"part.stl", "floor.stl"});
  CHECK(made["units"] == "mm");
  CHECK(made["up"] == "z");
  CHECK(made["moves"] == "part");
  CHECK(choice(made, "units").find("guessed") != std::string::npos);
  CHECK(made["start"]["kept"] == false);
  CHECK(made["start"]["shift"][2] < -400);
  CHECK(made["start"]["gap"] > 0);
  CHECK(made["start"]["gap"] < 2);
  const Json scene = check_runs(box, made);
  CHECK(scene["units"] == "mm");
  CHECK(box.files() == std::set<std::string>{"part.stl", "floor.stl", "scene.json", "scene.csv"});
}

TEST_CASE("a peg in its hole stays there, with voxels for its clearance") {
  Sandbox box;
  // Four walls around a square hole of 10.4 mm, a peg of 10.
  std::vector<Facet> hole = box_between({-20, -20, 0}, {-5.2f, 20, 15});
  for (const auto& wall :
       {box_between({5.2f, -20, 0}, {20, 20, 15}), box_between({-5.2f, -20, 0}, {5.2f, -5.2f, 15}),
        box_between({-5.2f, 5.2f, 0}, {5.2f, 20, 15})})
    hole = both(hole, wall);
  spill(box.file("hole.stl"), stl(hole));
  spill(box.file("peg.stl"), stl(box_between({-5, -5, 2}, {5, 5, 40})));
  const Json made = new_scene(box, {"peg.stl", "hole.stl"});
  CHECK(made["start"]["kept"] == true);
  CHECK(made["start"]["overlaps"] == false);
  CHECK(made["start"]["gap"].get<double>() == doctest::Approx(0.2).epsilon(0.01));
  CHECK(choice(made, "fields").find("clearance") != std::string::npos);
  check_runs(box, made);
}

TEST_CASE("a part deep in another starts outside, along the shortest way or up") {
  Sandbox box;
  spill(box.file("part.stl"), stl(box_between({-10, -10, -30}, {10, 10, 10})));
  spill(box.file("block.stl"), stl(box_between({-40, -40, -40}, {40, 40, 0})));
  const Json made = new_scene(box, {"part.stl", "block.stl", "-o", "inside.json"});
  CHECK(made["start"]["kept"] == false);
  CHECK(made["start"]["shift"][0] == 0);
  CHECK(made["start"]["shift"][2] > 30);
  CHECK(made["start"]["shift"][2] < 40);
  CHECK(choice(made, "start").find("outside along +z") != std::string::npos);
  check_runs(box, made, "inside.json");
}

TEST_CASE("a press fit keeps its place, and comes back to touch") {
  Sandbox box;
  std::vector<Facet> jaws = box_between({-30, -20, -20}, {-10, 20, 20});
  jaws = both(jaws, box_between({10, -20, -20}, {30, 20, 20}));
  spill(box.file("jaws.stl"), stl(jaws));
  spill(box.file("peg.stl"), stl(box_between({-10.05f, -10, -10}, {10.05f, 10, 10})));
  const Json made = new_scene(box, {"peg.stl", "jaws.stl"});
  CHECK(made["start"]["kept"] == true);
  CHECK(made["start"]["overlaps"] == true);
  check_runs(box, made);
}

TEST_CASE("--units, --up and -o win, and meshes from elsewhere are copied beside the scene") {
  Sandbox box;
  fs::create_directories(box.file("out"));
  spill(box.file("part.stl"), stl(box_between({0, 0, 3}, {2, 2, 5})));
  spill(box.file("floor.stl"), stl(box_between({-5, -5, -2}, {5, 5, 0})));
  const Json made = new_scene(
      box, {"part.stl", "floor.stl", "--units", "cm", "--up", "y", "-o", "out/scene.json"});
  CHECK(made["units"] == "cm");
  CHECK(made["up"] == "y");
  check_runs(box, made, "out/scene.json");
  CHECK(fs::exists(box.file("out/part.stl")));
  CHECK(slurp(box.file("out/floor.stl")) == slurp(box.file("floor.stl")));
}

TEST_CASE("the same command twice is fine, but a scene changed by hand is not overwritten") {
  Sandbox box;
  spill(box.file("part.stl"), stl(box_between({0, 0, 30}, {20, 20, 50})));
  spill(box.file("floor.stl"), stl(box_between({-50, -50, -20}, {50, 50, 0})));
  const Args args{"new", "part.stl", "floor.stl", "--no-view"};
  CHECK(run(box, args).code == 0);
  CHECK(run(box, args).code == 0);
  Json scene = Json::parse(slurp(box.file("scene.json")));
  scene["contact"]["stiffness"] = 12345;
  spill(box.file("scene.json"), scene.dump());
  const Ended refused = run(box, args);
  CHECK(refused.code == 1);
  CHECK(refused.err.find("--force") != std::string::npos);
  CHECK(Json::parse(slurp(box.file("scene.json"))) == scene);
  Args forced = args;
  forced.push_back("--force");
  CHECK(run(box, forced).code == 0);
  CHECK(Json::parse(slurp(box.file("scene.json"))) != scene);
}

TEST_CASE("run says how a scene is made of meshes, the smaller one first") {
  Sandbox box;
  spill(box.file("part.stl"), stl(box_facets(20)));
  spill(box.file("bay.stl"), stl(box_facets(100)));
  for (const Args& args :
       {Args{"run", "bay.stl", "part.stl"}, Args{"run", "part.stl", "bay.stl"}}) {
    const Ended ended = run(box, args);
    CHECK(ended.code == 2);
    CHECK(ended.err.find("'hapsix new part.stl bay.stl'") != std::string::npos);
  }
  const Ended one = run(box, {"run", "bay.stl"});
  CHECK(one.code == 2);
  CHECK(one.err.find("'hapsix new bay.stl ENVIRONMENT'") != std::string::npos);
  CHECK(run(box, {"run", "peg-in-hole", "peg-in-hole"}).code == 2);
}

TEST_CASE("a start far from the hand, a scene without hands and a part that sinks are told") {
  Sandbox box;
  spill(box.file("part.stl"), stl(box_facets(20)));
  spill(box.file("floor.stl"), stl(box_between({-50, -50, -60}, {50, 50, -20})));
  spill(box.file("hand.csv"), "t,x,y,z,qw,qx,qy,qz\n0,0,0,400,1,0,0,0\n0.5,0,0,400,1,0,0,0\n");
  Json scene = Json::parse(R"({"hapsix": 1, "units": "mm", "bodies": [
    {"name": "floor", "fixed": true, "field": {"mesh": "floor.stl", "voxel_size": 2}},
    {"name": "part", "shell": {"mesh": "part.stl", "points": 500}}],
    "hands": [{"body": "part", "path": "hand.csv"}]})");
  spill(box.file("scene.json"), scene.dump());
  Ended ended = run(box, {"run", "scene.json", "--virtual-time"});
  CHECK(ended.code == 0);
  CHECK(ended.err.find("starts 400 mm from where its hand begins") != std::string::npos);
  scene.erase("hands");
  spill(box.file("scene.json"), scene.dump());
  ended = run(box, {"run", "scene.json", "--virtual-time", "--json"});
  CHECK(ended.err.find("no hands") != std::string::npos);
  CHECK(one_object(ended)["verdict"] == "untouched");
  // It starts a quarter of a voxel deep and is pushed out, and no hand held it.
  scene["contact"] = {{"fit", "tight"}};
  scene["bodies"][1]["pose"] = {{"p", {0, 0, -20.5}}};
  spill(box.file("scene.json"), scene.dump());
  const Json alone = result_of(box, {"run", "scene.json", "--virtual-time"});
  CHECK(alone["contacts"]["max"] > 0);
  CHECK(alone["verdict"] == "unheld");
}

// Real pairs: assembled, free in place, threaded, and in frames of their own.
TEST_CASE("real meshes: from two files to contact with one command") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (!folder || !fs::exists(fs::path(folder) / "nut-bolt")) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  const std::array<std::array<const char*, 2>, 8> pairs{{
      {"beams/0.obj", "beams/1.obj"},  // one overlaps the other, and is no fit
      {"screw/screw-big.obj", "screw/nut-big.obj"},
      {"gears/factory_gear_medium_space_5e-4.obj",
       "gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj"},
      {"peg-hole/factory_round_peg_16mm_tight.obj",
       "peg-hole/factory_round_hole_16mm_subdiv_3x.obj"},
      {"ariac/pump_base.stl", "ariac/insert_collision.stl"},
      {"shells/hip_fe_module_shell_cover.STL", "shells/hip_fe_module_shell_base.STL"},
      {"nut-bolt/factory_nut_m16_loose_subdiv_3x.obj", "nut-bolt/factory_bolt_m16_tight.obj"},
      {"screw/anchor.obj", "soups/robosim_chassis_new.stl"},
  }};
  for (const auto& [part, environment] : pairs) {
    CAPTURE(part);
    Sandbox box;
    const Json made = new_scene(
        box, {(fs::path(folder) / part).string(), (fs::path(folder) / environment).string()});
    check_runs(box, made);
  }
}
