// SPDX-License-Identifier: Apache-2.0
// The program reads its own files back to the same physics, and the same input gives the same bits.
#include <cmath>
#include <set>
#include <string>

#include "tests/io/cli/program.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

TEST_CASE("an exported scene runs like the scene it came from") {
  Sandbox box;
  const Json list = result_of(box, {"scene", "list"});
  for (const Json& scene : list["scenes"]) {
    const std::string name = scene["name"];
    CAPTURE(name);
    // With a sanitizer these take minutes each, and smaller meshes test the threads of a bake too.
    if (kSanitized && (name == "engine-bay" || name == "landing-gear")) continue;
    REQUIRE(run(box, {"scene", "export", name, "exported/" + name}).code == 0);
    const auto run_of = [&](const std::string& what, const std::string& method) {
      Args args{"run", what, "--virtual-time", "--method", method};
      // Machines with thousands of contacts take half a minute for their whole way.
      const bool large = name.starts_with("spline-hub") || name == "piston-in-bore";
      if (kThreadSanitized || large) args.insert(args.end(), {"--duration", "0.2"});
      return result_of(box, args);
    };
    for (const std::string method : {"robust", "firm"}) {
      if (kSanitized && method == "firm") continue;
      CAPTURE(method);
      const Json named = run_of(name, method);
      const Json exported = run_of("exported/" + name + "/scene.json", method);
      CHECK(exported["verdict"] == named["verdict"]);
      CHECK(exported["frames"] == named["frames"]);
      const double depth = named["max_depth_voxels"], again = exported["max_depth_voxels"];
      // Mesh files have single precision, so the last digits may change, and with them a contact.
      if (method == "robust") {
        CHECK(again == doctest::Approx(depth).epsilon(0.05));
        CHECK(exported["max_force"].get<double>() ==
              doctest::Approx(named["max_force"].get<double>()).epsilon(0.02));
      }
      // Pushes of firm that lean rub, so a last digit may decide where a part sticks.
      CHECK(std::fabs(again - depth) < 0.1);
    }
  }
}

TEST_CASE("baked files in a scene give the very run of the meshes they came from") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(20, 16)));
  spill(box.file("block.stl"), stl(box_facets(60)));
  // The hand pushes the ball 5 mm into the top of the block.
  spill(box.file("hand.csv"),
        "t,x,y,z,qw,qx,qy,qz\n0,30,30,85,1,0,0,0\n0.5,30,30,75,1,0,0,0\n0.8,30,30,75,1,0,0,0\n");
  Json scene = Json::parse(R"({"hapsix": 1, "units": "mm",
    "bodies": [{"name": "block", "fixed": true, "field": {"mesh": "block.stl", "voxels": 48}},
               {"name": "ball", "mass": 0.1, "com": [0,0,0], "inertia": [1e-5,1e-5,1e-5,0,0,0],
                "pose": {"p": [30,30,85]}, "shell": {"mesh": "ball.stl", "points": 800}}],
    "hands": [{"body": "ball", "path": "hand.csv"}]})");
  spill(box.file("mesh.json"), scene.dump());
  const Json from_mesh = result_of(box, {"run", "mesh.json", "--virtual-time"});
  REQUIRE(from_mesh["contacts"]["max"] > 0);
  CHECK(from_mesh["verdict"] == "held");

  const Json field = result_of(box, {"bake", "field", "block.stl", "-o", "block.vdb", "--units",
                                     "mm", "--voxels", "48", "--threads", "1"});
  const Json shell = result_of(box, {"bake", "shell", "ball.stl", "-o", "ball.ply", "--units", "mm",
                                     "--points", "800", "--threads", "1"});
  scene["bodies"][0]["field"] = {{"file", "block.vdb"}};
  scene["bodies"][1]["shell"] = {{"file", "ball.ply"}};
  spill(box.file("baked.json"), scene.dump());
  const Json from_files = result_of(box, {"run", "baked.json", "--virtual-time"});
  // The first assets were baked with all threads, these with one.
  CHECK(from_files["state_hash"] == from_mesh["state_hash"]);
  CHECK(from_files["max_depth_voxels"] == from_mesh["max_depth_voxels"]);

  const Json field_info = result_of(box, {"info", "block.vdb"});
  CHECK(field_info["dims"] == field["dims"]);
  CHECK(field_info["bricks"] == field["bricks"]);
  CHECK(field_info["triangles"] == field["triangles"]);
  CHECK(field_info["sign_mode"] == field["sign_mode"]);
  CHECK(field_info["offset_m"] == field["offset"]);
  CHECK(field_info["voxel_size_m"] == field["voxel_size"]);
  const Json shell_info = result_of(box, {"info", "ball.ply"});
  CHECK(shell_info["points"] == shell["points"]);
  CHECK(shell_info["level_points"] == shell["level_points"]);

  // The option --units decides: the same numbers read as metres give a mesh 1000 times as large.
  const Json large = result_of(
      box, {"bake", "field", "block.stl", "-o", "large.vdb", "--voxels", "48", "--units", "m"});
  CHECK(large["voxel_size"].get<double>() ==
        doctest::Approx(1000 * field["voxel_size"].get<double>()));
}

TEST_CASE(
    "the same run gives the same bits, by one thread or two, from fresh assets or the cache") {
  Sandbox box;
  const Args args{"run", "alpha-shortcut", "--virtual-time", "--duration", "4"};
  const auto with_threads = [&](const char* n) {
    Args more = args;
    more.push_back("--threads"), more.push_back(n);
    return result_of(box, more);
  };
  const Json first = result_of(box, args);
  REQUIRE(first["contacts"]["max"] > 0);
  CHECK(result_of(box, args)["state_hash"] == first["state_hash"]);
  CHECK(with_threads("1")["state_hash"] == first["state_hash"]);
  CHECK(with_threads("2")["state_hash"] == first["state_hash"]);
  Args other = args;
  other.push_back("--method"), other.push_back("global");
  CHECK(result_of(box, other)["state_hash"] != first["state_hash"]);  // another motion
}

TEST_CASE("a recording holds every frame and the result of its run") {
  Sandbox box;
  const Json run_result =
      result_of(box, {"run", "peg-in-hole", "--virtual-time", "--record", "run.h5"});
  const Json info = result_of(box, {"info", "run.h5"});
  CHECK(info["frames"] == run_result["frames"]);
  CHECK(info["whole"] == true);
  CHECK(info["summary"]["state_hash"] == run_result["state_hash"]);
  CHECK(info["summary"]["verdict"] == run_result["verdict"]);
  CHECK(box.files() == std::set<std::string>{"run.h5"});  // no temporary file
  // A second run replaces it.
  result_of(box,
            {"run", "peg-in-hole", "--virtual-time", "--duration", "0.1", "--record", "run.h5"});
  CHECK(result_of(box, {"info", "run.h5"})["frames"] == 100);
  CHECK(box.files() == std::set<std::string>{"run.h5"});
}
