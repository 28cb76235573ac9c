// SPDX-License-Identifier: Apache-2.0
// scene_file_test.cpp - scene files: the scenes read from them, and the errors of bad files.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>

#include "tests/io/scene/scene_samples.h"

using namespace h6;
using namespace h6::io;

// ---- good files --------------------------------------------------------------------------------

TEST_CASE("a scene with only what is needed has the engine's defaults for the rest") {
  const Bench bench;
  const Result<Scene> scene = bench.read(small_scene());
  REQUIRE_MESSAGE(scene, scene.error());
  CHECK(scene->name == "scene");  // the name of the file
  CHECK(scene->rate == 1000);
  CHECK(scene->duration == 0);
  CHECK(scene->integrator == H6_IMPLICIT);
  CHECK(scene->gradient == H6_SYMMETRIC);
  check_same(scene->contact, h6DefaultContactDef());
  check_same(scene->coupling, h6DefaultCouplingDef());
  check_same(scene->bodies[1].pose, h6Pose{{0, 0, 0}, {1, 0, 0, 0}});
  CHECK(scene->bodies[1].mass == h6::test::near(0.1));
  CHECK(!scene->bodies[1].com);
  CHECK(!scene->bodies[0].shell);
  CHECK(scene->bodies[0].field->bake.voxels == FieldBake{}.voxels);
  CHECK(!scene->bodies[0].field->unit);
  CHECK(scene->hands[0].device == "path");
  check_same(scene->hands[0].def, default_scene_hand());
  CHECK(scene->hands[0].def.mode == H6_IMPEDANCE);
  CHECK(!scene->hands[0].arm);
  CHECK(!scene->net_stiffness);
  CHECK(!scene->bodies[1].translation_only);
  REQUIRE(scene->hands[0].path.size() == 2);
  check_same(scene->hands[0].path[1].pose, h6Pose{{0.01, 0, -0.02}, {0, 1, 0, 0}});
  CHECK(scene->verdict.forbidden.empty());
}

TEST_CASE("every key arrives, lengths in metres") {
  const Bench bench;
  const Result<Scene> read = bench.read(full_scene());
  REQUIRE_MESSAGE(read, read.error());
  const Scene& s = *read;
  CHECK(s.name == "all keys");
  CHECK(s.about == "every one");
  CHECK(s.unit == Unit::mm);
  const FieldSource& field = *s.bodies[0].field;
  CHECK(field.mesh == bench.path / "bay.stl");
  CHECK(field.bake.voxels == 1024);
  check_close(field.bake.offset, 0.5e-3);
  CHECK(field.bake.sign == SignMode::flood);
  CHECK(field.bake.cavities == Cavities::hollow);
  check_close(field.bake.seal, 2.5e-3);
  CHECK(field.unit == Unit::in);
  CHECK(field.bake.band_voxels == 4);
  CHECK(field.bake.padding_voxels == 9);
  check_close(s.bodies[1].field->bake.voxel_size, 0.25e-3);
  CHECK(s.bodies[1].field->bake.offset < 0);
  CHECK(s.bodies[2].field->file == bench.path / "baked.vdb");
  CHECK(s.bodies[2].field->mesh.empty());
  const SceneBody& part = s.bodies[3];
  check_close(part.mass, 0.25);
  check_same(*part.com, h6Vec3{1e-3, 2e-3, 3e-3});
  check_close((*part.inertia)[4], -2e-5);
  check_same(part.pose, h6Pose{{0.01, -0.02, 0.03}, {0, 0.6, 0.8, 0}});
  CHECK(part.shell->bake.points == 777);
  CHECK(part.shell->bake.levels == 5);
  CHECK(part.shell->bake.seed == 42);
  CHECK(part.shell->bake.surface == ShellSurface::field);
  CHECK(part.shell->bake.normals == ShellNormals::triangles);
  CHECK(part.shell->bake.field.voxels == 96);
  check_close(part.shell->bake.field.offset, 0.5e-3);
  check_close(part.shell->bake.field.seal, 1.5e-3);
  check_close(s.bodies[4].shell->bake.field.voxel_size, 0.25e-3);
  CHECK(part.shell->unit == Unit::cm);
  check_close(s.bodies[4].shell->bake.spacing, 0.75e-3);
  CHECK(s.bodies[5].shell->file == bench.path / "part.ply");
  CHECK(s.contact.method == H6_METHOD_GAUSS6);
  CHECK(s.contact.pieces == (H6_PIECE_FACING | H6_PIECE_PRODUCT | H6_PIECE_GEODESIC));
  check_close(s.contact.series_c, 3);
  check_close(s.contact.margin_voxels, 0.25);
  check_close(s.contact.cluster_voxels, 0.75);
  check_close(s.contact.stiffness, 2e4);
  check_close(s.contact.damping, 2e-3);
  check_close(s.contact.global_n0, 7);
  check_close(s.contact.epsilon, 0.02);
  check_close(s.contact.epsilon_normal, 0.03);
  check_close(s.contact.epsilon_torque, 0.9);
  check_close(s.contact.torque_length, 1.5e-3);
  check_close(s.coupling.stiffness, 1500);
  check_close(s.coupling.rotational_stiffness, 0.7);
  check_close(s.coupling.damping_ratio, 0.8);
  check_close(s.coupling.max_depth_voxels, 0.4);
  check_close(s.coupling.max_force, 3);
  check_close(s.coupling.max_torque, 0.2);
  CHECK(s.integrator == H6_EXPLICIT);
  CHECK(s.gradient == H6_EXACT);
  CHECK(s.rate == 2000);
  CHECK(s.max_substeps == 5);
  CHECK(s.duration == 1.25);
  CHECK(s.contact.passivity);
  CHECK(s.coupling.mode == H6_COUPLING_STATIC);
  check_close(s.coupling.max_step_voxels, 0.3);
  CHECK(s.net_stiffness);
  CHECK(s.bodies[4].translation_only);
  CHECK(!s.bodies[3].translation_only);
  const h6HandDef& hand = s.hands[0].def;
  CHECK(hand.mode == H6_PSEUDO_ADMITTANCE);
  check_close(hand.filter.motion_scale, 2);
  check_close(hand.filter.rotation_scale, 1.5);
  check_close(hand.filter.force_scale, 0.5);
  CHECK(hand.filter.relative);
  CHECK(hand.filter.clutch_buttons == 5);
  check_close(hand.manipulandum_mass, 0.2);
  check_close(hand.driver_stiffness, 900);
  check_close(hand.driver_damping, 4);
  check_close(hand.admittance_damping, 6);
  CHECK(hand.passivity);
  CHECK(hand.delay_frames == 1);
  CHECK(hand.delay_known);
  const h6SafetyDef& safety = hand.safety;
  check_close(safety.max_force, 3.5);
  check_close(safety.max_torque, 0.25);
  check_close(safety.max_force_rate, 700);
  check_close(safety.max_torque_rate, 70);
  check_close(safety.max_power, 1.5);
  check_close(safety.max_speed, 0.5);
  check_close(safety.derate_speed, 0.75);
  check_close(safety.cut_speed, 1.25);
  check_close(safety.soft_start, 0.5);
  check_close(safety.decay_time, 0.01);
  check_close(safety.pose_jump, 8e-3);
  check_close(safety.freeze_time, 0.25);
  CHECK(safety.dead_man_buttons == 6);
  CHECK(s.hands[0].device == "arm");
  REQUIRE(s.hands[0].arm);
  const SceneArm& arm = *s.hands[0].arm;
  CHECK(arm.delay_frames == 2);
  CHECK(arm.exact_velocity);
  check_same(arm.workspace.low, h6Vec3{-0.09, -0.08, -0.07});
  check_same(arm.workspace.high, h6Vec3{0.1, 0.11, 0.12});
  for (const Setting& row : arm_figures()) {
    const double said = full_scene()["hands"][0]["arm"][row.name].get<double>();
    const double got = row.member.number(row.member.get(&arm));
    INFO(row.name);
    check_close(got, row.is_length() ? 1e-3 * said : said);
    CHECK(got != row.start);  // else a default would pass for a value that was read
  }
  CHECK(s.hands[1].device == "simulated");
  CHECK(s.hands[1].path.empty());
  check_same(s.verdict.forbidden[0].low, h6Vec3{-1e-3, -2e-3, -3e-3});
  check_same(s.verdict.target->p, h6Vec3{5e-3, 6e-3, 7e-3});
  check_close(s.verdict.tolerance, 2e-3);
  check_close(s.verdict.tolerance_angle, 0.1);
}

TEST_CASE("coupling modes and hand modes are known by their names, and the names come back") {
  const Bench bench;
  const std::pair<const char*, h6CouplingMode> couplings[] = {{"dynamic", H6_COUPLING_DYNAMIC},
                                                              {"static", H6_COUPLING_STATIC},
                                                              {"direct", H6_COUPLING_DIRECT}};
  const std::pair<const char*, std::uint32_t> hands[] = {
      {"impedance", H6_IMPEDANCE},
      {"admittance", H6_ADMITTANCE},
      {"pseudo-admittance", H6_PSEUDO_ADMITTANCE}};
  for (const auto& [coupling, coupling_mode] : couplings)
    for (const auto& [hand, hand_mode] : hands) {
      Json json = small_scene();
      json["coupling"]["mode"] = coupling;
      json["hands"][0]["mode"] = hand;
      const Result<Scene> scene = bench.read(json);
      REQUIRE_MESSAGE(scene, scene.error());
      CHECK(scene->coupling.mode == coupling_mode);
      CHECK(scene->hands[0].def.mode == hand_mode);
      const Json text = Json::parse(scene_text(*scene));
      CHECK(text["coupling"]["mode"] == coupling);
      CHECK(text["hands"][0]["mode"] == hand);
    }
}

TEST_CASE("switches that are off and an arm that is not described are not written") {
  const Bench bench;
  const Json text = Json::parse(scene_text(*bench.read(small_scene())));
  CHECK(!text.contains("net_stiffness"));
  CHECK(!text["contact"].contains("passivity"));
  CHECK(!text["bodies"][1].contains("translation_only"));
  for (const char* key : {"relative", "passivity", "safety", "arm"})
    CHECK(!text["hands"][0].contains(key));
}

TEST_CASE("units scale every length and nothing else") {
  const Bench bench;
  Json json = full_scene();
  const Scene in_mm = *bench.read(json);
  json["hands"][0]["safety"].erase("pose_jump");  // its range is in metres
  json["units"] = "m";
  const Scene in_m = *bench.read(json);
  check_close(in_m.bodies[3].pose.p.z, 1000 * in_mm.bodies[3].pose.p.z);
  check_close(in_m.bodies[1].field->bake.voxel_size, 1000 * in_mm.bodies[1].field->bake.voxel_size);
  check_close(in_m.contact.torque_length, 1000 * in_mm.contact.torque_length);
  check_close(in_m.hands[0].path[1].pose.p.x, 1000 * in_mm.hands[0].path[1].pose.p.x);
  check_close(in_m.hands[0].arm->workspace.high.x, 1000 * in_mm.hands[0].arm->workspace.high.x);
  check_close(in_m.hands[0].arm->position_step, 1000 * in_mm.hands[0].arm->position_step);
  check_close(in_m.hands[0].arm->grip_stiffness, in_mm.hands[0].arm->grip_stiffness);
  check_close(in_m.contact.stiffness, in_mm.contact.stiffness);
  check_same(in_m.coupling, in_mm.coupling);
}

TEST_CASE("a quaternion within 0.001 of unit length is normalised") {
  const Bench bench;
  Json json = small_scene();
  json["bodies"][1]["pose"]["q"] = {0.7071, 0.7071, 0, 0};
  const Result<Scene> scene = bench.read(json);
  REQUIRE_MESSAGE(scene, scene.error());
  check_close(scene->bodies[1].pose.q.w, std::sqrt(0.5));
}

// ---- bad files ---------------------------------------------------------------------------------

TEST_CASE("an unknown key is named with its full path and the nearest known key") {
  const Bench bench;
  Json json = small_scene();
  json["bodies"][1]["shell"]["pionts"] = 3;
  std::string error = bench.error(json);
  CHECK(says(error, "scene.json"));
  CHECK(says(error, "bodies[1].shell.pionts"));
  CHECK(says(error, "\"points\""));
  json = small_scene();
  json["bodies"][0]["field"]["voxelsize"] = 3;
  error = bench.error(json);
  CHECK(says(error, "bodies[0].field.voxelsize"));
  CHECK(says(error, "\"voxel_size\""));
  json = small_scene();
  json["cuopling"] = Json::object();
  CHECK(says(bench.error(json), "\"coupling\""));
}

TEST_CASE("every wrong value is refused with the path of its key") {
  const Bench bench;
  struct Wrong {
    const char* pointer;
    const char* value;
    const char* said;
  };
  const Wrong wrongs[] = {
      {"/hapsix", "2", "hapsix: is 2"},
      {"/hapsix", "\"1\"", "hapsix: must be a number"},
      {"/units", "\"km\"", "units: must be one of: m, mm, cm, in"},
      {"/name", "\"a\\u0007b\"", "name: holds a control character"},
      {"/name", "\"\"", "name: must have"},
      {"/bodies", "[]", "bodies: must not be empty"},
      {"/bodies", "{}", "bodies: must be a list"},
      {"/bodies/0", "7", "bodies[0]: must be an object"},
      {"/bodies/0/fixed", "1", "bodies[0].fixed: must be true or false"},
      {"/bodies/1/mass", "0", "bodies[1].mass: is 0 but must be at least 1e-06"},
      {"/bodies/1/mass", "-1", "bodies[1].mass"},
      {"/bodies/1/mass", "1e300", "bodies[1].mass"},
      {"/bodies/1/mass", "null", "bodies[1].mass: must be a number"},
      {"/bodies/1/com", "[1, 2]", "bodies[1].com: must be a list of 3 numbers"},
      {"/bodies/1/com", "[1, 2, 1e30]", "bodies[1].com[2]"},
      {"/bodies/1/com", "[1, 2, \"3\"]", "bodies[1].com[2]: must be a number"},
      {"/bodies/1/inertia", "[1, 1, 1, 2, 0, 0]", "bodies[1].inertia: is not positive definite"},
      {"/bodies/1/inertia", "[0, 0, 0, 0, 0, 0]", "bodies[1].inertia: is not positive definite"},
      {"/bodies/1/inertia", "[1, 1, 1e300, 1e-300, 0, 1e300]", "bodies[1].inertia"},
      {"/bodies/1/pose", "{\"q\": [0, 0, 0, 0]}", "bodies[1].pose.q: is not a unit quaternion"},
      {"/bodies/1/pose", "{\"q\": [1.01, 0, 0, 0]}", "bodies[1].pose.q: is not a unit quaternion"},
      {"/bodies/1/pose", "{\"q\": [1e200, 0, 0, 0]}", "bodies[1].pose.q"},
      {"/bodies/1/name", "\"bay\"", "bodies[1].name: there is another body \"bay\""},
      {"/bodies/1/shell", "{}", "bodies[1].shell: needs either"},
      {"/bodies/1/shell", "{\"mesh\": \"bay.stl\", \"file\": \"part.ply\"}",
       "bodies[1].shell: needs"},
      {"/bodies/1/shell", "{\"file\": \"part.ply\", \"points\": 5}",
       "bodies[1].shell.points: has no"},
      {"/bodies/1/shell", "{\"file\": \"part.ply\", \"units\": \"mm\"}", "bodies[1].shell.units"},
      {"/bodies/1/shell/mesh", "\"gone.stl\"",
       "bodies[1].shell.mesh: there is no file \"gone.stl\""},
      {"/bodies/1/shell/mesh", "\".\"", "bodies[1].shell.mesh: there is no file"},
      {"/bodies/1/shell/points", "0", "bodies[1].shell.points"},
      {"/bodies/1/shell/points", "10.5", "bodies[1].shell.points: must be a whole number"},
      {"/bodies/1/shell/points", "100000000000", "bodies[1].shell.points"},
      {"/bodies/1/shell/spacing", "0", "bodies[1].shell.spacing"},
      {"/bodies/1/shell/levels", "17", "bodies[1].shell.levels"},
      {"/bodies/1/shell/surface", "\"inside\"", "bodies[1].shell.surface"},
      {"/bodies/1/shell/voxels", "8", "bodies[1].shell.voxels"},
      {"/bodies/0/field/voxels", "15", "bodies[0].field.voxels"},
      {"/bodies/0/field/voxels", "4096", "at most 2048"},
      {"/bodies/0/field/voxel_size", "-1", "bodies[0].field.voxel_size"},
      {"/bodies/0/field/offset", "-0.1", "bodies[0].field.offset"},
      {"/bodies/0/field/sign", "\"rays\"",
       "bodies[0].field.sign: must be one of: auto, flood, winding"},
      {"/bodies/0/field/sign", "\"auto|flood\"", "bodies[0].field.sign"},
      {"/bodies/0/field/cavities", "true", "bodies[0].field.cavities"},
      {"/contact", "{\"method\": \"guass3\"}", "contact.method: \"guass3\" is no method"},
      {"/contact", "{\"stiffness\": -1}", "contact.stiffness"},
      {"/contact", "{\"damping\": -1}", "contact.damping"},
      {"/contact", "{\"global_n0\": 0.5}", "contact.global_n0"},
      {"/contact", "{\"epsilon\": 0}", "contact.epsilon: is 0 but must be above 0 and at most 2"},
      {"/contact", "{\"epsilon_normal\": 2.1}", "contact.epsilon_normal"},
      {"/contact", "{\"epsilon_torque\": 0}", "contact.epsilon_torque"},
      {"/contact", "{\"torque_length\": -1}", "contact.torque_length"},
      {"/contact", "{\"series_c\": 2}", "contact.series_c"},
      {"/contact", "{\"margin_voxels\": 3}", "contact.margin_voxels"},
      {"/contact", "{\"cluster_voxels\": 0}", "contact.cluster_voxels"},
      {"/contact", "{\"passivity\": 1}", "contact.passivity: must be true or false"},
      {"/coupling", "{\"mode\": \"statics\"}",
       "coupling.mode: must be one of: dynamic, static, direct"},
      {"/coupling", "{\"max_step_voxels\": 0}", "coupling.max_step_voxels"},
      {"/bodies/1/translation_only", "3", "bodies[1].translation_only: must be true or false"},
      {"/net_stiffness", "\"yes\"", "net_stiffness: must be true or false"},
      {"/coupling", "{\"stiffness\": 0}", "coupling.stiffness"},
      {"/coupling", "{\"damping_ratio\": 11}", "coupling.damping_ratio"},
      {"/coupling", "{\"max_depth_voxels\": 0}", "coupling.max_depth_voxels"},
      {"/coupling", "{\"max_force\": -1}", "coupling.max_force"},
      {"/integrator", "\"verlet\"", "integrator: must be one of: implicit, explicit"},
      {"/gradient", "[]", "gradient: must be one of"},
      {"/rate", "99", "rate: is 99 but must be at least 100 and at most 10000"},
      {"/rate", "10001", "rate"},
      {"/max_substeps", "0", "max_substeps: is 0 but must be at least 1 and at most 64"},
      {"/duration", "-1", "duration"},
      {"/hands", "{}", "hands: must be a list"},
      {"/hands/0/body", "\"prat\"", "hands[0].body: there is no body \"prat\""},
      {"/hands/0/body", "\"bay\"", "hands[0].body: \"bay\" is fixed"},
      {"/hands/0/path", "\"gone.csv\"", "hands[0].path: there is no file \"gone.csv\""},
      {"/hands/0/mode", "\"admitance\"",
       "hands[0].mode: must be one of: impedance, admittance, pseudo-admittance"},
      {"/hands/0/motion_scale", "0", "hands[0].motion_scale: is 0 but must be at least 1e-06"},
      {"/hands/0/rotation_scale", "-1", "hands[0].rotation_scale"},
      {"/hands/0/force_scale", "1e7", "hands[0].force_scale"},
      {"/hands/0/relative", "1", "hands[0].relative: must be true or false"},
      {"/hands/0/clutch_buttons", "0.5", "hands[0].clutch_buttons: must be a whole number"},
      {"/hands/0/clutch_buttons", "4294967296", "hands[0].clutch_buttons"},
      {"/hands/0/manipulandum_mass", "0", "hands[0].manipulandum_mass"},
      {"/hands/0/driver_stiffness", "-1", "hands[0].driver_stiffness"},
      {"/hands/0/driver_damping", "51", "hands[0].driver_damping"},
      {"/hands/0/admittance_damping", "-1", "hands[0].admittance_damping"},
      {"/hands/0/passivity", "null", "hands[0].passivity"},
      {"/hands/0/safety", "{\"pose_jump\": 60}",
       "hands[0].safety.pose_jump: is 60 but must be at least 1 and at most 50"},
      {"/hands/0/arm", "[]", "hands[0].arm: must be an object"},
      {"/hands/0/arm", "{\"delay\": 1}", "hands[0].arm.delay: no such key"},
      {"/hands/0/arm", "{\"delay_frames\": 3}", "hands[0].arm.delay_frames: is 3"},
      {"/hands/0/arm", "{\"delay_frames\": 0.5}", "hands[0].arm.delay_frames: must be a whole"},
      {"/hands/0/arm", "{\"velocity\": true}", "hands[0].arm.velocity: must be one of: filtered"},
      {"/hands/0/arm", "{\"workspace\": [[0, 0, 0], [1, 1, 0]]}", "hands[0].arm.workspace"},
      {"/hands/1", "{\"body\": \"part\", \"device\": \"simulated\"}",
       "hands[1].body: another hand"},
      {"/verdict", "{\"forbidden\": [{}]}", "verdict.forbidden[0].box: is missing"},
      {"/verdict", "{\"forbidden\": [{\"box\": [[0,0,0]]}]}",
       "verdict.forbidden[0].box: must be two"},
      {"/verdict", "{\"forbidden\": [{\"box\": [[0,0,0],[1,0,1]]}]}", "lower than the second"},
      {"/verdict", "{\"target\": {\"pose\": {}}}", "verdict.target.tolerance: is missing"},
      {"/verdict", "{\"target\": {\"pose\": {}, \"tolerance\": 0}}", "verdict.target.tolerance"},
  };
  REQUIRE(bench.read(small_scene()));
  for (const Wrong& wrong : wrongs) {
    Json json = small_scene();
    json[Json::json_pointer(wrong.pointer)] = Json::parse(wrong.value);
    const std::string error = bench.error(json);
    INFO(wrong.pointer << " = " << wrong.value << " -> " << error);
    CHECK(says(error, wrong.said));
    CHECK(says(error, "scene.json"));
  }
}

TEST_CASE("every figure of an arm has a range, and the key is named where it is left") {
  const Bench bench;
  for (const Setting& key : arm_figures())
    for (const double wrong : {-1.0, 1e8}) {
      Json json = small_scene();
      json["hands"][0]["arm"][key.name] = wrong;
      const std::string error = bench.error(json);
      INFO(error);
      CHECK(says(error, std::string("hands[0].arm.") + key.name + ": is "));
    }
}

TEST_CASE("what a scene needs and does not have is named") {
  const Bench bench;
  for (const char* key : {"hapsix", "bodies"}) {
    Json json = small_scene();
    json.erase(key);
    CHECK(says(bench.error(json), std::string(key) + ": is missing"));
  }
  Json json = small_scene();
  json["bodies"][1].erase("name");
  CHECK(says(bench.error(json), "bodies[1].name: is missing"));
  json = small_scene();
  json["bodies"][1].erase("shell");
  CHECK(says(bench.error(json), "bodies[1]: needs a \"shell\""));
  json = small_scene();
  json["hands"][0].erase("path");
  CHECK(says(bench.error(json), "hands[0].path: is missing"));
  json = small_scene();
  json["hands"] = Json::array();
  json["verdict"]["forbidden"] = Json::parse(R"([{"box": [[0,0,0],[1,1,1]]}])");
  CHECK(says(bench.error(json), "there is no hand"));
}

TEST_CASE("two ways to give one size are one too many") {
  const Bench bench;
  Json json = small_scene();
  json["bodies"][0]["field"]["voxels"] = 100;
  json["bodies"][0]["field"]["voxel_size"] = 1;
  CHECK(says(bench.error(json), "bodies[0].field.voxel_size: stands beside \"voxels\""));
  json = small_scene();
  json["bodies"][1]["shell"]["points"] = 100;
  json["bodies"][1]["shell"]["spacing"] = 1;
  CHECK(says(bench.error(json), "bodies[1].shell.spacing: stands beside \"points\""));
}

TEST_CASE("text that is not JSON is refused with line and column") {
  const Folder folder;
  const auto error = [&](const std::string& text) {
    const Result<Scene> scene = read_scene(folder.write("s.json", text));
    REQUIRE(!scene);
    return scene.error();
  };
  CHECK(says(error("{\n \"hapsix\": 1,\n   oops }"), "line 3, column 4"));
  CHECK(says(error("{\"hapsix\": 1e999}"), "line 1, column 1"));
  CHECK(says(error("{\"hapsix\": NaN}"), "line 1, column 1"));
  CHECK(says(error(""), "line 1, column 1"));
  CHECK(says(error("{\"a\": 1} {"), "line 1, column 10"));
  CHECK(says(error(std::string("{\"a\xff\": 1}")), "not valid JSON"));
  CHECK(says(error("[1]"), "must be an object"));
  CHECK(says(error("{\"rate\": 1, \"rate\": 2}"), "\"rate\" stands twice"));
  for (const char c : error("{\"a\": \"\x01\x1b[31m\"}")) CHECK((c >= ' ' && c <= '~'));
}

TEST_CASE("hostile JSON costs neither stack nor memory") {
  const Folder folder;
  const auto error = [&](const std::string& text) {
    const Result<Scene> scene = read_scene(folder.write("s.json", text));
    REQUIRE(!scene);
    return scene.error();
  };
  CHECK(says(error(std::string(5'000'000, '[')), "nested deeper"));
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
  CHECK(says(error(deep), "nested deeper"));
  std::string many = "[0";
  for (int i = 0; i < 1'100'000; ++i) many += ",0";
  CHECK(says(error(many + "]"), "million values"));
  CHECK(says(error("{\"" + std::string(1'000'000, 'k') + "\": 1}"), "no such key"));
  fs::resize_file(folder.path / "s.json", (std::uintmax_t{64} << 20) + 1);
  const Result<Scene> large = read_scene(folder.path / "s.json");
  REQUIRE(!large);
  CHECK(says(large.error(), "larger than 64 MiB"));
}

TEST_CASE("a scene file that is not there, or is a folder, is one sentence") {
  const Folder folder;
  CHECK(says(read_scene(folder.path / "none.json").error(), "none.json: no such file"));
  CHECK(says(read_scene(folder.path).error(), "no such file"));
}

TEST_CASE("every truncation of a scene file is refused, and no change of bytes brings it down") {
  const Bench bench;
  const std::string good = full_scene().dump(1);
  for (std::size_t n = 0; n < good.size(); n += 7)
    REQUIRE(!read_scene(bench.write("cut.json", good.substr(0, n))));
  std::mt19937_64 random(7);
  std::size_t refused = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string bad = good;
    for (int change = 0; change < 1 + round % 4; ++change) {
      const std::size_t at = random() % bad.size();
      if (random() % 2)
        bad[at] = static_cast<char>(random() % 256);
      else
        bad.erase(at, 1 + random() % 5);
      if (bad.empty()) bad = " ";
    }
    const Result<Scene> scene = read_scene(bench.write("bad.json", bad));
    refused += !scene;
    if (!scene) REQUIRE(!scene.error().empty());
  }
  CHECK(refused > 600);
}
