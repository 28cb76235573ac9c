// SPDX-License-Identifier: Apache-2.0
// Tests the robustness map: runs, comparison in pairs, equal walls, and what it says.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "io/experiments/map/map_page.h"
#include "io/experiments/probe.h"
#include "tests/support/sanitized.h"

using namespace h6;
using namespace h6::cli;

namespace {

MethodColumn method(const std::string& name) {
  for (const MethodColumn& column : method_columns())
    if (column.name == name) return column;
  REQUIRE_MESSAGE(false, name);
  return {};
}

MapOptions options(const std::vector<std::string>& methods, const std::vector<std::string>& scenes,
                   std::size_t variations) {
  MapOptions out;
  for (const std::string& name : methods) out.methods.push_back(method(name));
  out.scenes = scenes;
  out.variations = variations;
  return out;
}

Console quiet() {
  Console console;
  console.json = true;
  return console;
}

bool says(const std::vector<std::string>& sentences, const std::string& words) {
  return std::any_of(sentences.begin(), sentences.end(), [&](const std::string& sentence) {
    return sentence.find(words) != std::string::npos;
  });
}

// A box that a hand presses onto a plate: the depth at which it comes to rest [m].
double rest_depth(const MethodColumn& column, double stiffness, double newtons) {
  io::Scene scene = posed_scene("pressed", plate(-40 * kMm, 40 * kMm), bottom(40, 40));
  scene.bodies.back().pose.p.z = 5.5 * kMm;
  io::HandPath hand(scene.bodies.back().pose);
  hand.wait(0.05).move_by({0, 0, -8 * kMm}, 20 * kMm).wait(1);
  scene.hands.push_back(io::path_hand("body", hand.rows()));
  const auto loaded = io::load_scene(std::move(scene));
  REQUIRE_MESSAGE(loaded, loaded.error());
  RunChange change;
  change.method = column;
  change.stiffness = stiffness;
  change.max_force = newtons;
  const RunFigures run = run_experiment(**loaded, change);
  REQUIRE(run.error.empty());
  CHECK(run.verdict == io::Verdict::held);
  return run.final_depth_voxels * kProbeVoxel;
}

}  // namespace

TEST_CASE("a seed gives the same figures to the bit with one thread and with two") {
  MapOptions o = options({"robust", "series"}, {"cone-in-gap", "box-over-wire"}, 3);
  o.jobs = 1;
  const std::vector<MapScene> one = run_map(o, quiet());
  const std::string first = MapReport{o, one}.json().dump(), rows = MapReport{o, one}.csv();
  o.jobs = 2;
  const std::vector<MapScene> two = run_map(o, quiet());
  CHECK(MapReport{o, two}.json().dump() == first);
  CHECK(MapReport{o, two}.csv() == rows);
  // Another seed is another map.
  o.seed = 2;
  CHECK(MapReport{o, run_map(o, quiet())}.csv() != rows);
  // One variation alone is the same as in the series.
  o.seed = 1, o.only = 2, o.scenes = {"box-over-wire"};
  const std::vector<MapScene> alone = run_map(o, quiet());
  REQUIRE(alone[0].variations.size() == 1);
  const MapVariation &a = alone[0].variations[0], &b = one[1].variations[2];
  REQUIRE(a.runs.size() == b.runs.size());
  for (std::size_t i = 0; i < a.runs.size(); ++i) {
    CHECK(a.runs[i].depth > 0);
    CHECK(a.runs[i].depth == b.runs[i].depth);
    CHECK(a.runs[i].verdict == b.runs[i].verdict);
  }
}

// Skipped under ThreadSanitizer: it would take minutes, and the case above covers the threads.
TEST_CASE("a rule that fails is found to hold fewer, and a rule beside itself is not" *
          doctest::skip(h6::test::kThreadSanitized)) {
  MapOptions o = options({"robust", "global", "robust"}, {"cone-in-gap"}, 10);
  const std::vector<MapScene> scenes = run_map(o, quiet());
  const std::vector<const MapScene*> all = {&scenes[0]};
  const GroupFigures robust = group_figures(all, kEqualStiffness, kAtSceneForce, 0);
  const GroupFigures global = group_figures(all, kEqualStiffness, kAtSceneForce, 1);
  CHECK(robust.runs == 10);
  CHECK(wilson(global.held, 10).high < wilson(robust.held, 10).low);
  const PairFigures pair = pair_figures(all, kEqualStiffness, 1);
  CHECK(pair.pairs == 10);
  CHECK(sign_of(pair.holds_more, pair.holds_fewer) == Sign::fewer);
  const PairFigures same = pair_figures(all, kEqualWall, 2);
  CHECK(same.better + same.worse + same.holds_more + same.holds_fewer == 0);
  CHECK(sign_of(same.holds_more, same.holds_fewer) == Sign::open);
  CHECK(sign_of_ratio(same.depth_ratios) == Sign::open);

  const std::vector<std::string> sentences = map_conclusions(scenes, o.methods);
  CHECK(says(sentences, "At equal stiffness `global` holds fewer in 1 of 1 scenes (cone-in-gap)"));
  CHECK_FALSE(says(sentences, "`global` holds more"));
  CHECK_FALSE(says(sentences, "`robust` holds fewer"));
  CHECK_FALSE(says(sentences, "`robust` is "));
}

TEST_CASE("pushes are counted by how hard they are, and every run once") {
  const MapOptions o = options({"robust"}, {"box-on-wall"}, 8);
  const std::vector<MapScene> scenes = run_map(o, quiet());
  const auto runs = [&](MapGroup group) {
    return group_figures({&scenes[0]}, kEqualStiffness, group, 0).runs;
  };
  CHECK(runs(kAtSceneForce) == 8);
  CHECK(runs(kAtHalfVoxelForce) == 8);
  CHECK(runs(kGentlyPushed) + runs(kHardPushed) == 8);
  CHECK(runs(kGentlyPushed) > 0);
  CHECK(runs(kHardPushed) > 0);
  for (const MapVariation& v : scenes[0].variations) {
    CHECK(v.newtons[kPushForce] == v.change.push * v.newtons[kSceneForce]);
    CHECK(v.newtons[kHalfVoxelForce] == doctest::Approx(5 * v.change.voxel));
  }
}

TEST_CASE("a hand that pushes half a voxel deep also turns no farther than half a voxel") {
  Variation finer;
  finer.voxel = 0.5, finer.push = 4;
  // The largest force and torque of a hand that has 2 N and 4 Nm in its scene.
  const auto most = [&](MapForce force) {
    const RunChange change = map_change(2, force, finer);
    h6SessionDef def = h6DefaultSessionDef();
    h6HandDef hand = h6DefaultHandDef();
    hand.coupling.max_torque = 4;
    if (change.also) change.also(def, hand);
    return std::pair(change.force * change.max_force, change.force * hand.coupling.max_torque);
  };
  CHECK(most(kHalfVoxelForce) == std::pair(2.0, 2.0));
  CHECK(most(kSceneForce) == std::pair(2.0, 4.0));
  CHECK(most(kPushForce) == std::pair(2.0, 16.0));
}

TEST_CASE("scaled stiffness makes a box rest equally deep on a wall under every rule" *
          doctest::skip(h6::test::kThreadSanitized)) {
  h6ContactDef contact = h6DefaultContactDef();
  contact.stiffness = 1e4;
  const double wall = wall_stiffness(contact, method("robust")), newtons = 2;
  for (const char* name : {"robust", "gauss3", "gauss6", "series", "global", "cluster"}) {
    CAPTURE(name);
    const double stiffer = wall / wall_stiffness(contact, method(name));
    const double k = stiffer * contact.stiffness;
    CHECK(rest_depth(method(name), k, newtons) ==
          doctest::Approx(newtons / (wall * contact.stiffness)).epsilon(0.01));
  }
  // Without the scaling they differ.
  CHECK(rest_depth(method("gauss6"), 0, newtons) > 1.5 * rest_depth(method("robust"), 0, newtons));
}

TEST_CASE("a scene that is left out is named with the reason") {
  MapOptions o = options({"robust"}, {}, 0);
  const std::vector<MapScene> scenes = run_map(o, quiet());
  CHECK(scenes.size() == map_scene_names().size());
  const MapReport report{o, scenes};
  for (const char* name : {"engine-bay", "landing-gear"}) {
    CHECK(report.json()["scenes"][name]["left_out"].get<std::string>().find("bakes") !=
          std::string::npos);
    CHECK(report.text(false).find("Left out: " + std::string(name)) != std::string::npos);
    CHECK(report.text(true).find("Left out: " + std::string(name)) != std::string::npos);
  }
  CHECK_FALSE(report.json()["scenes"]["cone-in-gap"].contains("left_out"));
  o.scenes = {"no-such-scene"};
  const std::vector<MapScene> none = run_map(o, quiet());
  CHECK(none[0].left_out.find("no-such-scene") != std::string::npos);
}

TEST_CASE("goals are judged for all scenes, and apart for those with implicit steps") {
  MapOptions o = options({"robust"}, {"box-on-wall", "box-on-wall-explicit", "box-over-wire"}, 2);
  const std::vector<MapScene> scenes = run_map(o, quiet());
  CHECK(implicit_scenes(run_scenes(scenes)).size() == 2);
  const MapReport report{o, scenes};
  const nlohmann::ordered_json json = report.json();
  CHECK(json["all"]["equal_stiffness"]["robust"]["scene"]["runs"] == 6);
  CHECK(json["implicit_steps"]["equal_stiffness"]["robust"]["scene"]["runs"] == 4);
  const TextTable table = report.table(kEqualStiffness);
  CHECK(table[table.size() - 2][0] == "all");
  CHECK(table.back()[0] == "all, implicit steps");
  const std::vector<std::string> sentences = map_conclusions(scenes, o.methods);
  for (const char* words :
       {"`robust` holds the scene's force in ",
        "`robust` holds the scene's force with implicit steps in ",
        "`robust` with the force of half a voxel with implicit steps is at most "})
    CHECK_MESSAGE(says(sentences, words), words);
  o.scenes = {"box-on-wall", "box-over-wire"};
  const std::vector<MapScene> implicit = run_map(o, quiet());
  CHECK_FALSE(says(map_conclusions(implicit, o.methods), "with implicit steps"));
}

TEST_CASE("the drawing has a mark for every run, a cross for each that is not held") {
  const MapOptions o = options({"robust", "global"}, {"cone-in-gap"}, 3);
  const std::vector<MapScene> scenes = run_map(o, quiet());
  const std::string drawing = map_drawing({o, scenes}, kEqualStiffness);
  const auto count = [&](const std::string& word) {
    std::size_t n = 0;
    for (std::size_t at = 0; (at = drawing.find(word, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  std::size_t held = 0;
  for (const MapVariation& v : scenes[0].variations)
    for (std::size_t m = 0; m < 2; ++m)
      for (int force = 0; force < kMapForces; ++force)
        held += v.run(kEqualStiffness, force, m).held;
  CHECK(count("<circle") == held);
  CHECK(count("<path") == 3 * 2 * kMapForces - held);
  CHECK(count("<path") > 0);
  CHECK(count("<title>cone-in-gap:2 global") == kMapForces);
  const std::string page = map_page({o, scenes});
  CHECK(page.find("<svg") != std::string::npos);
  CHECK(page.find("<td>global</td>") != std::string::npos);
  CHECK(page.find("the goal of 99 % is") != std::string::npos);
}
