// hapsix experiments: the schema that other programs read, the report and recordings, mistakes.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "tests/cli/program.h"

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
