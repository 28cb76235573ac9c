// SPDX-License-Identifier: Apache-2.0
// Tests --json: stdout has one object with the keys that other programs rely on, and stderr has the
// text for people.
#include <string>
#include <utility>
#include <vector>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

void has(const Json& object, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    CAPTURE(key);
    CHECK(object.contains(key));
  }
}

void is_a_run(const Json& run) {
  has(run, {"start_overlap", "frames", "contacts", "max_depth_voxels", "verdict", "pop_through",
            "remarks", "frame_us", "stage_us", "deadline", "final_pose", "hand_pose", "max_force",
            "max_torque", "status_bits", "state_hash", "events"});
  has(run.value("contacts", Json()), {"mean", "max"});
  has(run.value("frame_us", Json()), {"p50", "p99", "p999", "max"});
  has(run.value("deadline", Json()),
      {"missed_compute", "missed_wakeup", "missed_stolen", "late_us"});
  for (const char* pose : {"final_pose", "hand_pose"}) {
    has(run.value(pose, Json()), {"p", "q"});
    CHECK(run[pose]["p"].size() == 3);
    double norm = 0;
    for (const Json& c : run[pose]["q"]) norm += c.get<double>() * c.get<double>();
    CHECK(norm == doctest::Approx(1));
  }
  CHECK(run["state_hash"].get<std::string>().size() == 16);
  CHECK(run["events"].is_array());
  CHECK(run["stage_us"].size() >= 5);
  for (const auto& [stage, times] : run["stage_us"].items())
    has(times, {"p50", "p99", "p999", "max"});
}

}  // namespace

TEST_CASE("bake says what it made, how long it took and what it found") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(50, 20)));
  const Json field = result_of(
      box, {"bake", "field", "ball.stl", "-o", "ball.vdb", "--units", "mm", "--voxels", "64"});
  has(field, {"seconds", "peak_bytes", "file_bytes", "voxel_size", "dims", "bricks", "triangles",
              "sign_mode", "offset", "warnings"});
  has(field["seconds"], {"read", "bake", "write"});
  CHECK(field["file_bytes"] == fs::file_size(box.file("ball.vdb")));
  CHECK(field["triangles"] == 20 * 2 * 40 - 80);
  CHECK(field["dims"] == Json({64, 64, 64}));
  CHECK(field["voxel_size"].get<double>() ==
        doctest::Approx(0.1 / 48).epsilon(0.05));  // [m], 8 of padding each side
  CHECK(field["warnings"].empty());
  CHECK(field["peak_bytes"].get<double>() > 1e6);

  const Json shell = result_of(
      box, {"bake", "shell", "ball.stl", "-o", "ball.ply", "--units", "mm", "--points", "500"});
  has(shell, {"seconds", "peak_bytes", "file_bytes", "points", "levels", "triangles", "warnings"});
  CHECK(shell["points"] == 500);
  CHECK(shell["file_bytes"] == fs::file_size(box.file("ball.ply")));

  // An open mesh gives the same keys and a warning, which also goes to stderr.
  std::vector<Facet> open = sphere_facets(50, 20);
  open.resize(open.size() - 200);
  spill(box.file("open.stl"), stl(open));
  const Ended ended = run(box, {"bake", "field", "open.stl", "-o", "open.vdb", "--units", "mm",
                                "--voxels", "64", "--json"});
  const Json soup = one_object(ended);
  CHECK(soup["closed"] == false);
  CHECK(soup["offset"].get<double>() > 0);
  for (const Json& warning : soup["warnings"])
    CHECK(ended.err.find("warning: " + warning.get<std::string>()) != std::string::npos);
}

TEST_CASE("run says all that a run is judged by") {
  Sandbox box;
  const Json virtual_run = result_of(box, {"run", "box-on-wall", "--virtual-time"});
  is_a_run(virtual_run);
  CHECK(virtual_run["verdict"] == "held");
  CHECK(virtual_run["contacts"]["max"] > 0);
  CHECK(virtual_run["max_force"] > 0);
  const Json real_run = result_of(box, {"run", "box-on-wall", "--duration", "0.2"});
  is_a_run(real_run);
  CHECK(real_run["frames"] == 200);
  for (const char* device : {"path", "simulated", "arm"})
    is_a_run(result_of(
        box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.1", "--device", device}));
  for (const char* method :
       {"none", "global", "gauss3", "gauss6", "robust", "gauss6+facing+depth"}) {
    const Json run = result_of(
        box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.1", "--method", method});
    is_a_run(run);
    CHECK(run["method"] == method);
  }
}

TEST_CASE("a scene says how its arm talks, and what telemetry it wants") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "box-on-wall", "scene"}).code == 0);
  Json scene = Json::parse(slurp(box.file("scene/scene.json")));
  CHECK(!result_of(box, {"run", "scene/scene.json", "--virtual-time", "--duration", "0.1"})
             .contains("net_stiffness"));
  scene["net_stiffness"] = true;
  std::vector<std::string> hashes;
  for (const char* mode : {"impedance", "admittance", "pseudo-admittance"}) {
    CAPTURE(mode);
    scene["hands"][0]["mode"] = mode;
    scene["hands"][0]["arm"]["delay_frames"] = 1;
    spill(box.file("scene/scene.json"), scene.dump());
    const Json json = result_of(box, {"run", "scene/scene.json", "--device", "arm",
                                      "--virtual-time", "--record", "run.h5"});
    is_a_run(json);
    CHECK(json["verdict"] == "held");
    CHECK(json["contacts"]["max"] > 20);
    CHECK(json["net_stiffness"]["max"] > 1000);
    hashes.push_back(json["state_hash"]);
    const Json info = result_of(box, {"info", "run.h5"});
    for (const char* column : {"hand_wrench", "command_pose", "net_stiffness"})
      CHECK(std::count(info["columns"].begin(), info["columns"].end(), column) == 1);
  }
  CHECK(hashes[0] != hashes[1]);
  CHECK(hashes[1] != hashes[2]);
  // Only the device "arm" has other modes than impedance.
  const Ended refused = run(box, {"run", "scene/scene.json", "--device", "path", "--json"});
  CHECK(refused.code == 1);
  CHECK(refused.err.find("impedance mode only") != std::string::npos);
}

TEST_CASE("info knows every kind of file the program reads or writes") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(50, 10)));
  REQUIRE(
      run(box, {"bake", "field", "ball.stl", "-o", "ball.vdb", "--units", "mm", "--voxels", "32"})
          .code == 0);
  REQUIRE(
      run(box, {"bake", "shell", "ball.stl", "-o", "ball.ply", "--units", "mm", "--points", "200"})
          .code == 0);
  REQUIRE(run(box, {"scene", "export", "box-on-wall", "scene"}).code == 0);
  REQUIRE(
      run(box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.3", "--record", "run.h5"})
          .code == 0);
  std::string path;  // the scene's one hand
  for (const std::string& name : box.files())
    if (fs::path(name).extension() == ".csv") path = name;
  const std::vector<std::pair<std::string, std::vector<std::string>>> kinds = {
      {"ball.stl mesh",
       {"triangles", "vertices", "closed", "open_edges", "low_m", "high_m", "volume_m3"}},
      {"ball.vdb field", {"dims", "voxel_size_m", "bricks", "offset_m", "sign_mode", "input_hash"}},
      {"ball.ply shell", {"points", "levels", "input_hash"}},
      {"scene/scene.json scene", {"name", "units", "bodies", "hands", "method", "rate"}},
      {path + " path", {"rows", "seconds"}},
      {"run.h5 recording", {"frames", "seconds", "rate", "hands", "whole", "events", "summary"}}};
  for (const auto& [file_and_kind, keys] : kinds) {
    const std::size_t blank = file_and_kind.find(' ');
    const std::string file = file_and_kind.substr(0, blank), kind = file_and_kind.substr(blank + 1);
    CAPTURE(file);
    const Json info = result_of(box, {"info", file, "--units", "mm"});
    CHECK(info["kind"] == kind);
    CHECK(info["file"] == file);
    has(info, keys);
    // The text for people states the same facts.
    const Ended plain = run(box, {"info", file, "--units", "mm"});
    CHECK(plain.code == 0);
    for (const std::string& key : keys) CHECK(plain.out.find(key) != std::string::npos);
  }
  CHECK(result_of(box, {"info", "run.h5"})["frames"] == 300);
  is_a_run(result_of(box, {"info", "run.h5"})["summary"]);
  const Json schema = one_object(run(box, {"info", "--schema"}));
  has(schema, {"$schema", "properties"});
}

TEST_CASE("scene list, scene export and demo") {
  Sandbox box;
  const Json list = result_of(box, {"scene", "list"});
  CHECK(list["scenes"].size() >= 3);
  for (const Json& scene : list["scenes"]) {
    has(scene, {"name", "about"});
    const std::string name = scene.value("name", "");
    CHECK(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos);
  }
  // For people: the same names in one column, and what they are about in another.
  std::istringstream lines(run(box, {"scene", "list"}).out);
  std::size_t rows = 0, column = 0;
  for (std::string line; std::getline(lines, line) && !line.empty(); ++rows) {
    REQUIRE(rows < list["scenes"].size());
    const std::string name = list["scenes"][rows]["name"], about = list["scenes"][rows]["about"];
    const std::size_t at = line.find(about);
    CHECK(line.rfind(name + "  ", 0) == 0);
    REQUIRE(at != std::string::npos);
    if (rows == 0) column = at;
    CHECK(at == column);
  }
  CHECK(rows == list["scenes"].size());
  const Json exported = result_of(box, {"scene", "export", "box-on-wall", "a/new/folder"});
  CHECK(exported["file"] == "a/new/folder/scene.json");
  CHECK(fs::exists(box.file("a/new/folder/scene.json")));

  const Json demo = result_of(box, {"demo", "--virtual-time", "--duration", "0.5", "-o", "demo"});
  has(demo, {"scene", "runs"});
  CHECK(demo["runs"].size() == 2);
  for (const Json& run : demo["runs"]) {
    is_a_run(run);
    CHECK(run["frames"] == 500);
    CHECK(fs::exists(box.file(run.value("recording", "nothing"))));
  }
}

TEST_CASE("without --json the result is on stdout and nothing else, and help goes there too") {
  Sandbox box;
  const Ended ended = run(box, {"run", "box-on-wall", "--virtual-time"});
  CHECK(ended.code == 0);
  CHECK(ended.out.find("held") != std::string::npos);
  CHECK(ended.out.find("warning") == std::string::npos);
  CHECK(ended.out.find("field of") == std::string::npos);  // preparation is reported on stderr
  CHECK(ended.err.find("field of wall") != std::string::npos);
  for (const Args& words : std::vector<Args>{{},
                                             {"bake"},
                                             {"bake", "field"},
                                             {"bake", "shell"},
                                             {"run"},
                                             {"info"},
                                             {"scene"},
                                             {"scene", "export"},
                                             {"new"},
                                             {"check"},
                                             {"replay"},
                                             {"report"},
                                             {"export"},
                                             {"devices"},
                                             {"experiments"},
                                             {"map"},
                                             {"study"},
                                             {"demo"}}) {
    Args args = words;
    args.push_back("--help");
    const Ended help = run(box, args);
    CHECK(help.code == 0);
    CHECK(help.err.empty());
    CHECK(help.out.find("Usage: hapsix") != std::string::npos);
    CHECK(help.out.find("--json") != std::string::npos);
    for (const char* leftover : {"Excludes:", "Needs:", "REQUIRED", "FILE FILE", "{false}", "(1x)", " UINT", " TEXT", " INT"})
      CHECK_MESSAGE(help.out.find(leftover) == std::string::npos, leftover);
  }
  CHECK(run(box, {"--version"}).out.rfind("hapsix ", 0) == 0);
  for (const Args& words : std::vector<Args>{{"--json", "--version"}, {"--version", "--json"}}) {
    const Json version = one_object(run(box, words));
    has(version, {"hapsix", "simd_targets"});
    CHECK(!version["simd_targets"].empty());
  }
}
