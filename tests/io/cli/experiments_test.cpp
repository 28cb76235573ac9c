// SPDX-License-Identifier: Apache-2.0
// Tests `hapsix experiments`: the JSON for other programs, the report, the recordings and errors.
#include <cmath>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

void is_a_scene(const Json& scene, const std::vector<std::string>& methods) {
  for (const std::string& method : methods) {
    CAPTURE(method);
    REQUIRE(scene.contains(method));
    const Json& run = scene[method];
    for (const char* key :
         {"verdict", "max_depth_voxels", "final_depth_voxels", "contacts_max", "contacts_mean",
          "force_jump", "late_speed", "late_depth_swing_voxels", "frame_us", "status_bits"})
      CHECK_MESSAGE(run.contains(key), key);
    CHECK(!run.contains("error"));
    CHECK(run["frame_us"].contains("p50"));
  }
}

const std::vector<std::string> kMethods = {"none",   "global",        "global/1",      "gauss3",
                                           "gauss6", "gauss3+facing", "gauss6+facing", "robust"};

}  // namespace

TEST_CASE("experiments --json has every method of a scene under the scene's name") {
  Sandbox box;
  const Json result = result_of(box, {"experiments", "cone-in-gap", "box-on-wall-explicit"});
  REQUIRE(result.contains("scenes"));
  CHECK(result["scenes"].size() == 2);
  CHECK(result["studies"].empty());
  CHECK(result["seconds"].get<double>() > 0);
  is_a_scene(result["scenes"]["cone-in-gap"], kMethods);
  is_a_scene(result["scenes"]["box-on-wall-explicit"], kMethods);
  const Json& cone = result["scenes"]["cone-in-gap"];
  CHECK(cone["robust"]["verdict"] == "held");
  CHECK(cone["global"]["verdict"] == "through");
  CHECK(cone["global"]["contacts_max"].get<int>() > 100);
  CHECK(cone["robust"]["force_jump"].get<double>() > 0);
  CHECK(box.files().empty());  // without -o nothing is written
}

TEST_CASE("the same experiment gives the same figures, and -o writes a report and recordings") {
  Sandbox box;
  const Json first = result_of(box, {"experiments", "rod-between-tubes", "-o", "a/new/folder"});
  const Json again = result_of(box, {"experiments", "rod-between-tubes"});
  for (const std::string& method : kMethods) {
    const Json &a = first["scenes"]["rod-between-tubes"][method],
               &b = again["scenes"]["rod-between-tubes"][method];
    for (const char* key : {"verdict", "max_depth_voxels", "contacts_max", "force_jump"})
      CHECK(a[key] == b[key]);
    const std::string recording = "a/new/folder/" + a.value("recording", "nothing");
    CHECK(fs::exists(box.file(recording)));
  }
  CHECK(first["report"] == "a/new/folder/EXPERIMENTS.md");
  const std::string report = slurp(box.file("a/new/folder/EXPERIMENTS.md"));
  for (const char* word : {"rod-between-tubes", "The paper: ", "prototype", "| robust |", "held"})
    CHECK_MESSAGE(report.find(word) != std::string::npos, word);
  const Json info = result_of(box, {"info", "a/new/folder/rod-between-tubes-robust.h5"});
  CHECK(info["whole"] == true);
}

// Skipped under ThreadSanitizer: it would take minutes, and other tests cover the same threads.
TEST_CASE("studies say what they measured for every method" * doctest::skip(kThreadSanitized)) {
  Sandbox box;
  const Json result = result_of(box, {"experiments", "plate-share", "smoothness", "net-stiffness"});
  CHECK(result["scenes"].empty());
  const Json& studies = result["studies"];
  CHECK(studies.size() == 3);
  for (const std::string& method : kMethods) {
    CAPTURE(method);
    for (const auto& [share, row] : studies["plate-share"].items()) {
      CHECK(row[method].contains("verdict"));
      CHECK(row[method].contains("final_depth_voxels"));
    }
    CHECK(studies["smoothness"]["tilt to flat"].contains(method));
    CHECK(studies["net-stiffness"]["wall, 144"][method].contains("derivative"));
  }
  for (const char* share : {"0.10", "0.05", "0.02", "0.01"})
    CHECK(studies["plate-share"][share]["robust"]["verdict"] == "held");
  // In a tenth of the time a continuous force changes a tenth as much, but a jump stays as large.
  const Json& edge = studies["smoothness"]["slide off an edge"];
  const auto shrinks = [&](const char* method) {
    return edge[method]["1ms"].get<double>() / edge[method]["0.1ms"].get<double>();
  };
  CHECK(shrinks("robust") > 5);
  CHECK(shrinks("gauss3") < 2);
  // METHOD.md gives these stiffnesses for 144 parallel contacts.
  const Json& wall = studies["net-stiffness"]["wall, 144"];
  CHECK(std::abs(wall["none"]["shares"].get<double>() - 144) < 0.1);
  CHECK(std::abs(wall["gauss3"]["derivative"].get<double>() - 1) < 0.02);
  CHECK(wall["gauss6"]["derivative"].get<double>() < 2.01);
  CHECK(wall["robust"]["derivative"].get<double>() < 5);
}

TEST_CASE("two inclined planes are as stiff as their normals say, whatever the weights" *
          doctest::skip(kThreadSanitized)) {
  Sandbox box;
  const Json planes = result_of(box, {"experiments", "two-planes"})["studies"]["two-planes"];
  CHECK(planes["alpha"].size() == 9);
  // With the paper's weights the contacts of a plane count as one, so the stiffnesses are 2 sin^2
  // and 2 cos^2. For the other methods they are larger by the sum of the shares of 64 contacts.
  CHECK(std::abs(planes["per_plane"]["gauss3"].get<double>() - 1) < 0.01);
  CHECK(std::abs(planes["per_plane"]["none"].get<double>() - 64) < 0.1);
  for (const char* method : {"none", "global", "gauss3", "gauss6", "robust"})
    CHECK(planes["deviation"][method].get<double>() < 0.01);
  const Json& steep = planes["alpha"]["75"]["gauss3"];
  CHECK(std::abs(steep["x"].get<double>() - 1.866) < 0.01);
  CHECK(std::abs(steep["z"].get<double>() - 0.134) < 0.01);
}

TEST_CASE("global scaling fails where it is said to, and with less stiffness where it does not" *
          doctest::skip(kThreadSanitized)) {
  Sandbox box;
  const Json found = result_of(box, {"experiments", "global"})["studies"]["global"];
  for (const char* scene : {"cone-in-gap", "rod-between-tubes", "peg-in-hole", "box-over-post"})
    CHECK(found[scene]["n0 = 10"]["fails"] == true);
  for (const auto& [scene, row] : found.items()) {
    CAPTURE(scene);
    CHECK(row["n0 = 1"]["fails"] == true);
    CHECK(row["robust"]["fails"] == false);
  }
}

TEST_CASE("an experiment that does not exist is told, with the nearest name") {
  Sandbox box;
  const Ended ended = run(box, {"experiments", "cone-in-gab"});
  CHECK(ended.code == 2);
  CHECK(ended.err.find("did you mean 'cone-in-gap'") != std::string::npos);
  spill(box.file("taken"), "x");
  const Ended blocked = run(box, {"experiments", "cone-in-gap", "-o", "taken"});
  CHECK(blocked.code == 1);
  CHECK(blocked.err.find("taken") != std::string::npos);
}

TEST_CASE("a method may have any pieces, and one that is named twice is one column") {
  Sandbox box;
  const Json result = result_of(
      box, {"experiments", "cone-in-gap", "--methods", "firm,gauss6,gauss6+facing+depth,firm"});
  const Json& scene = result["scenes"]["cone-in-gap"];
  is_a_scene(scene, {"firm", "gauss6", "gauss6+facing+depth"});
  CHECK(scene["gauss6"] != scene["gauss6+facing+depth"]);
}

TEST_CASE("wrong methods are told before a folder is made") {
  Sandbox box;
  const auto told = [&](const char* methods, const std::string& words) {
    const Ended ended =
        run(box, {"experiments", "cone-in-gap", "--methods", methods, "-o", "figures"});
    CHECK(ended.code == 2);
    CHECK_MESSAGE(ended.err.find(words) != std::string::npos, ended.err);
  };
  told("robst", "did you mean 'robust'?");
  told(",", "',' names no method");
  told("robust+fast", "no method 'robust+fast'");
  CHECK(box.files().empty());
}
