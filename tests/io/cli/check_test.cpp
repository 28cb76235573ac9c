// SPDX-License-Identifier: Apache-2.0
// Runs `hapsix check` on meshes, scenes and fields, and tests its output and its exit code.
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

bool near(double a, double b, double tolerance) { return std::fabs(a - b) <= tolerance; }

std::vector<Facet> scaled(std::vector<Facet> facets, float x, float y, float z) {
  for (Facet& f : facets)
    for (Corner& c : f) c = {x * c[0], y * c[1], z * c[2]};
  return facets;
}

}  // namespace

TEST_CASE(
    "a plate's thickness comes in voxels, with the force it withstands and what a bake takes") {
  Sandbox box;
  spill(box.file("plate.stl"), stl(scaled(box_facets(1), 100, 100, 2)));
  const Json all = result_of(
      box, {"check", "plate.stl", "--units", "mm", "--voxel-size", "0.5", "--stiffness", "1e5"});
  CHECK(all["agrees"].is_null());  // nothing was compared
  const Json plate = all["meshes"][0];
  CHECK(plate["closed"] == true);
  CHECK(near(plate["voxel_size"].get<double>(), 5e-4, 1e-12));
  CHECK(near(plate["walls_voxels"]["p5"].get<double>(), 4, 1e-4));
  CHECK(near(plate["walls_voxels"]["median"].get<double>(), 4, 1e-4));
  CHECK(plate["gaps_voxels"].is_null());
  // A lone contact is up to 3.5 k stiff and half the thickness deep.
  CHECK(plate["holding_force_N"].get<double>() > 0.5 * 1e5 * 1e-3);
  CHECK(plate["holding_force_N"].get<double>() < 3.5 * 1e5 * 1e-3);
  CHECK(plate["pushed_places"].get<int>() > 100);
  CHECK(plate["bricks_estimate"].get<int>() > 100);
  CHECK(plate["field_bytes_estimate"].get<double>() > 1e5);
  CHECK(plate["bake_seconds_estimate"].get<double>() > 0);
  CHECK(plate["warnings"].empty());
  // Voxels as large as the plate is thick give a warning.
  const Json coarse = result_of(box, {"check", "plate.stl", "--units", "mm", "--voxel-size", "2"});
  REQUIRE(coarse["meshes"][0]["warnings"].size() == 1);
  CHECK(coarse["meshes"][0]["warnings"][0].get<std::string>().find("thinner than two voxels") !=
        std::string::npos);
  // As text there is one block for each mesh.
  const Ended text = run(box, {"check", "plate.stl", "plate.stl", "--units", "mm"});
  CHECK(text.code == 0);
  CHECK(text.out.find("plate.stl: 12 triangles, closed") != std::string::npos);
  CHECK(text.out.find("walls") != std::string::npos);
  CHECK(box.files() == std::set<std::string>{"plate.stl"});
}

TEST_CASE("a baked field is compared with its mesh: 0 when it agrees, 1 when it is another's") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(50, 20)));
  spill(box.file("other.stl"), stl(sphere_facets(52, 20)));
  const Json baked = result_of(
      box, {"bake", "field", "ball.stl", "-o", "ball.vdb", "--units", "mm", "--voxels", "96"});
  const Args compare{"--units",  "mm",   "--field",      "ball.vdb",
                     "--points", "2000", "--far-points", "2000"};
  const auto with = [&](Args args) {
    args.insert(args.end(), compare.begin(), compare.end());
    return args;
  };
  const Json good = result_of(box, with({"check", "ball.stl"}));
  CHECK(good["agrees"] == true);
  const Json field = good["meshes"][0]["field"];
  CHECK(field["agrees"] == true);
  CHECK(good["meshes"][0]["voxel_size"] == baked["voxel_size"]);
  CHECK(field["nodes"].get<int>() > 1500);
  CHECK(field["node_error_max"].get<double>() < 1e-3);
  CHECK(field["sides_drained"] == 0);
  CHECK(field["far_above"] == 0);

  Args json = with({"check", "other.stl"});
  json.push_back("--json");
  const Ended bad = run(box, json);
  CHECK(bad.code == 1);
  const Json said = one_object(bad);
  CHECK(said["agrees"] == false);
  CHECK(said["meshes"][0]["field"]["node_error_max"].get<double>() > 1);
  CHECK(run(box, with({"check", "other.stl"})).out.find("DISAGREES") != std::string::npos);

  // Without a field file, check bakes one for the comparison.
  const Json fresh = result_of(box, {"check", "other.stl", "--units", "mm", "--voxels", "64",
                                     "--verify", "--points", "1000", "--far-points", "1000"});
  CHECK(fresh["agrees"] == true);
}

TEST_CASE(
    "of a scene every body that is touched as a field is checked, with the scene's stiffness") {
  Sandbox box;
  result_of(box, {"scene", "export", "peg-in-hole", "."});
  const Json scene = Json::parse(slurp(box.file("scene.json")));
  std::size_t fields = 0;
  for (const Json& body : scene["bodies"]) fields += body.contains("field");
  const Json all = result_of(box, {"check", "scene.json"});
  CHECK(all["meshes"].size() == fields);
  CHECK(fields > 0);
  for (const Json& m : all["meshes"]) CHECK(m["triangles"].get<int>() > 0);
}

TEST_CASE("a field with a tolerance is checked between its nodes, in its finest voxel") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(50, 20)));
  const Args check{"check",    "ball.stl", "--units", "mm",           "--tolerance", "0.2",
                   "--verify", "--points", "4000",    "--far-points", "2000"};
  const Json all = result_of(box, check);
  CHECK(all["agrees"] == true);
  const Json ball = all["meshes"][0];
  CHECK(near(ball["voxel_size"].get<double>(), 1.2e-3, 1e-12));
  CHECK(near(ball["finest_voxel"].get<double>(), 3e-4, 1e-12));
  CHECK(ball["field"]["tolerance_places"].get<int>() > 3000);
  CHECK(ball["field"]["tolerance_missed"] == 0);
  CHECK(ball["field"]["tolerance_error_max"].get<double>() <= 1);
  CHECK(ball["field"]["tolerance_error_max"].get<double>() > 0.05);
  CHECK(ball["holding_force_N"].get<double>() > 1);
  // A baked field knows its tolerance.
  result_of(box,
            {"bake", "field", "ball.stl", "-o", "ball.vdb", "--units", "mm", "--tolerance", "0.2"});
  const Json baked = result_of(box, {"check", "ball.stl", "--units", "mm", "--field", "ball.vdb",
                                     "--points", "1000", "--far-points", "1000"});
  CHECK(baked["meshes"][0]["field"]["tolerance_places"].get<int>() > 500);
}

TEST_CASE("where a tool goes through a wall check says where, and exits 1") {
  Sandbox box;
  std::vector<Facet> sheet = scaled(box_facets(1), 40, 40, 1);
  sheet.resize(2);  // one side
  spill(box.file("sheet.stl"), stl(sheet));
  const Args lost{"check", "sheet.stl", "--units", "mm", "--voxel-size", "1", "--offset", "0"};
  Args json = lost;
  json.push_back("--json");
  const Ended ended = run(box, json);
  CHECK(ended.code == 1);
  CHECK(one_object(ended)["meshes"][0]["holding_force_N"] == 0);
  const Ended text = run(box, lost);
  CHECK(text.code == 1);
  CHECK(text.err.find("holds nothing: a tool goes through at (") != std::string::npos);
  CHECK(text.out.find("none holds") != std::string::npos);
  // With the offset that a bake chooses it holds.
  const Json held = result_of(box, {"check", "sheet.stl", "--units", "mm", "--voxel-size", "1"});
  CHECK(held["meshes"][0]["holding_force_N"].get<double>() > 1);
}

TEST_CASE("a field that was closed by winding agrees with its mesh of holes, and names them") {
  Sandbox box;
  std::vector<Facet> ball = sphere_facets(50, 20);
  ball.erase(ball.begin() + std::ptrdiff_t(ball.size()) / 2,
             ball.begin() + std::ptrdiff_t(ball.size()) / 2 + 4);
  spill(box.file("ball.stl"), stl(ball));
  const Json baked = result_of(box, {"bake", "field", "ball.stl", "-o", "ball.vdb", "--units", "mm",
                                     "--voxels", "96", "--sign", "winding"});
  CHECK(baked["closed"] == false);
  CHECK(baked["sign_mode"] == "winding");
  CHECK(baked["offset"] == 0);
  CHECK(baked["leaks"]["count"] == 0);
  CHECK(baked["sealed"]["count"].get<int>() > 0);
  const Json checked =
      result_of(box, {"check", "ball.stl", "--field", "ball.vdb", "--units", "mm"});
  CHECK(checked["agrees"] == true);
}

TEST_CASE("how far a scene's shells are from its fields at the start is told in voxels") {
  Sandbox box;
  spill(box.file("cube.stl"), stl(box_facets(10)));
  const Json body{{"mesh", "cube.stl"}};
  Json field = body;
  field["voxel_size"] = 0.5;
  const Json scene{{"hapsix", 1},
                   {"units", "mm"},
                   {"bodies",
                    {{{"name", "floor"}, {"fixed", true}, {"field", field}},
                     {{"name", "part"},
                      {"shell", {{"mesh", "cube.stl"}, {"points", 500}}},
                      {"pose", {{"p", {2, 1, 12}}, {"q", {1, 0, 0, 0}}}}}}}};
  spill(box.file("scene.json"), scene.dump());
  const Json all = result_of(box, {"check", "scene.json"});
  const Json start = all["meshes"][0]["clearances"];
  REQUIRE(start.size() == 1);
  CHECK(start[0]["shell"] == "part");
  CHECK(near(start[0]["distance_m"].get<double>(), 2e-3, 1e-8));
  CHECK(near(start[0]["voxels"].get<double>(), 4, 1e-4));
}

TEST_CASE("wrong input gets one sentence and the right code") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(50, 10)));
  spill(box.file("empty.stl"), "");
  spill(box.file("no.vdb"), "this is no field");
  struct Case {
    Args args;
    int code;
  };
  const std::vector<Case> cases = {
      {{"check"}, 2},
      {{"check", "gone.stl"}, 1},
      {{"check", "empty.stl"}, 1},
      {{"check", "ball.stl", "--field", "gone.vdb"}, 1},
      {{"check", "ball.stl", "--field", "no.vdb"}, 1},
      {{"check", "ball.stl", "ball.stl", "--field", "no.vdb"}, 2},
      {{"check", "ball.stl", "--field", "no.vdb", "--verify"}, 2},
      {{"check", "ball.stl", "--voxels", "7"}, 2},
      {{"check", "ball.stl", "--voxel-size", "1e-9"}, 1},
      {{"check", "ball.stl", "--points", "0"}, 2},
  };
  for (const Case& c : cases) {
    const Ended ended = run(box, c.args);
    CAPTURE(ended.err);
    CHECK(ended.code == c.code);
    CHECK(!ended.err.empty());
    CHECK(ended.out.empty());
  }
}
