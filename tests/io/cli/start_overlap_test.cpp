// SPDX-License-Identifier: Apache-2.0
// A run says which parts overlap at its start: on the console, in JSON, in a CSV file and in its
// recording. It refuses a start that is too deep.
#include <algorithm>
#include <string>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

// The facets of a box of these sides.
std::vector<Facet> box_of(const Corner& low, const Corner& high) {
  std::vector<Facet> facets = box_facets(1);
  for (Facet& facet : facets)
    for (Corner& c : facet)
      for (std::size_t k = 0; k < 3; ++k) c[k] = low[k] + c[k] * (high[k] - low[k]);
  return facets;
}

// A peg between the jaws of a vice, with voxels of 1 mm; it overlaps each jaw by this many. A floor
// lies far below both.
void make_scene(Sandbox& box, float overlap, const Json& contact = Json::object()) {
  std::vector<Facet> jaws = box_of({-30, -20, -20}, {-10, 20, 20});
  for (const Facet& facet : box_of({10, -20, -20}, {30, 20, 20})) jaws.push_back(facet);
  const float wide = 10 + overlap;
  spill(box.file("jaws.stl"), stl(jaws));
  spill(box.file("peg.stl"), stl(box_of({-wide, -10, -10}, {wide, 10, 10})));
  spill(box.file("floor.stl"), stl(box_of({-40, -40, -60}, {40, 40, -50})));
  spill(box.file("hand.csv"), "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.1,0,0,0,1,0,0,0\n");
  Json scene = Json::parse(R"({"hapsix": 1, "units": "mm", "bodies": [
    {"name": "floor", "fixed": true, "field": {"mesh": "floor.stl", "voxel_size": 1}},
    {"name": "jaws", "fixed": true, "field": {"mesh": "jaws.stl", "voxel_size": 1}},
    {"name": "peg", "mass": 0.1, "shell": {"mesh": "peg.stl", "points": 2000}}],
    "hands": [{"body": "peg", "device": "path", "path": "hand.csv"}]})");
  scene["contact"] = contact;
  spill(box.file("scene.json"), scene.dump());
}

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("an overlap of 0.7 voxel is told on the console, in JSON, CSV and the recording") {
  Sandbox box;
  make_scene(box, 0.7f);
  const Ended ended = run(box, {"run", "scene.json", "--virtual-time", "--json", "--record",
                                "run.h5", "--overlap", "points.csv"});
  CHECK(ended.code == 0);
  const Json json = one_object(ended);
  REQUIRE(json["start_overlap"].size() == 1);
  const Json& o = json["start_overlap"][0];
  CAPTURE(o.dump());
  CHECK(o["part"] == "peg");
  CHECK(o["with"] == "jaws");
  CHECK(o["depth_voxels"].get<double>() == doctest::Approx(0.7).epsilon(1e-3));
  CHECK(o["depth"].get<double>() == doctest::Approx(0.7).epsilon(1e-3));  // [mm], as the scene
  CHECK(std::fabs(o["place"][0].get<double>()) == doctest::Approx(10.7).epsilon(1e-3));
  CHECK(o["points"] > 100);
  CHECK(o["points"] < 2000);
  CHECK(o["relieved"] == o["points"]);

  const std::string said =
      "'peg' overlaps 'jaws' at " + o["points"].dump() + " points, 0.7 voxels (0.7 mm) deep at (";
  CHECK(ended.err.find(said) != std::string::npos);
  const Json info = result_of(box, {"info", "run.h5"});
  for (const Json* events : {&json["events"], &info["summary"]["events"]}) {
    REQUIRE(!events->empty());
    const Json& first = (*events)[0];
    CHECK(first["t"] == 0);
    CHECK(first["what"] == "overlap");
    CHECK(first["detail"].get<std::string>().starts_with(said));
  }

  const std::string csv = slurp(box.file("points.csv"));
  CHECK(csv.starts_with("part,with,point,x,y,z,depth,depth_voxels,with_part,with_triangle\n"));
  CHECK(lines(csv) == 1 + o["points"].get<std::size_t>());
  std::istringstream in(csv);
  std::string line;
  std::getline(in, line);
  double deepest = 0;
  while (std::getline(in, line)) {
    unsigned point;
    double x, y, z, depth, voxels;
    REQUIRE(std::sscanf(line.c_str(), "\"peg\",\"jaws\",%u,%lf,%lf,%lf,%lf,%lf,", &point, &x, &y,
                        &z, &depth, &voxels) == 6);
    CHECK(point < 2000);
    CHECK(depth == doctest::Approx(std::fabs(x) - 10).epsilon(1e-3));
    CHECK(voxels == doctest::Approx(depth));
    deepest = std::max(deepest, depth);
  }
  CHECK(deepest == doctest::Approx(o["depth"].get<double>()));
}

TEST_CASE("a start without an overlap says nothing of one") {
  Sandbox box;
  make_scene(box, -0.2f);
  const Ended ended =
      run(box, {"run", "scene.json", "--virtual-time", "--json", "--overlap", "points.csv"});
  CHECK(ended.code == 0);
  const Json json = one_object(ended);
  CHECK(json["start_overlap"].is_array());
  CHECK(json["start_overlap"].empty());
  CHECK(ended.err.find("overlap") == std::string::npos);
  for (const Json& event : json["events"]) CHECK(event["what"] != "overlap");
  CHECK(lines(slurp(box.file("points.csv"))) == 1);
}

TEST_CASE("a start five voxels deep is refused by name, writes nothing, and runs under `tight`") {
  Sandbox box;
  make_scene(box, 5);
  const std::set<std::string> before = box.files();
  const Args args = {"run",     "scene.json", "--virtual-time", "--record",   "run.h5",
                     "--trace", "run.json",   "--overlap",      "points.csv", "--json"};
  Ended ended = run(box, args);
  CHECK(ended.code == 1);
  const std::string why = one_object(ended)["error"];
  CAPTURE(why);
  // Below its band the field knows only that it is at least so deep.
  for (const char* words :
       {"'peg' starts inside 'jaws', at least 4.", " mm) deep at (", "beyond 3 voxels",
        "would take no part", "another pose", "units", "larger voxels", "\"fit\": \"tight\""})
    CHECK(why.find(words) != std::string::npos);
  CHECK(ended.err.find(why) != std::string::npos);
  CHECK(box.files() == before);

  make_scene(box, 5, {{"fit", "tight"}});
  ended = run(box, args);
  CHECK(ended.code == 0);
  CHECK(one_object(ended)["start_overlap"][0]["relieved"] == 0);
  CHECK(ended.err.find(" mm; every depth pushes\n") != std::string::npos);
  CHECK(fs::exists(box.file("points.csv")));
}

TEST_CASE("--overlap wants a CSV file in a folder that exists") {
  Sandbox box;
  make_scene(box, 0.7f);
  CHECK(run(box, {"run", "scene.json", "--overlap", "points.txt"}).code == 2);
  const Ended ended = run(box, {"run", "scene.json", "--overlap", "gone/points.csv"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("gone does not exist") != std::string::npos);
}
