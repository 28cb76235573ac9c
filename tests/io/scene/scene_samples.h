// SPDX-License-Identifier: Apache-2.0
// scene_samples.h - scenes as JSON for tests, the files they name, and when two scenes are the
// same.
#pragma once
#include <doctest/doctest.h>
#include <unistd.h>
#include "tests/support/near.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/scene/keys.h"
#include "io/scene/scene_file.h"

namespace h6::io {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A folder that is gone when the test is.
struct Folder {
  fs::path path;
  Folder() {
    static int count = 0;
    path = fs::temp_directory_path() /
           ("hapsix_scene_" + std::to_string(getpid()) + "_" + std::to_string(count++));
    fs::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path write(const std::string& name, const std::string& text) const {
    fs::remove(path / name);  // some file systems flush a file that is written over
    std::ofstream(path / name, std::ios::binary) << text;
    return path / name;
  }
};

inline std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline bool says(const std::string& sentence, const std::string& part) {
  return sentence.find(part) != std::string::npos;
}

// The files that the scenes below name, and two scenes with every key between them.
struct Bench : Folder {
  Bench() {
    write("bay.stl", "not read here");
    write("part.ply", "nor this");
    write("baked.vdb", "nor this");
    write("hand.csv", "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.5,10,0,-20,0,1,0,0\n");
  }
  Result<Scene> read(const Json& json) const {
    return read_scene(write("scene.json", json.dump(1)));
  }
  std::string error(const Json& json) const {
    const Result<Scene> scene = read(json);
    return scene ? std::string("(read without complaint)") : scene.error();
  }
};

inline Json small_scene() {
  return Json::parse(R"({"hapsix": 1, "units": "mm", "bodies": [
      {"name": "bay", "fixed": true, "field": {"mesh": "bay.stl"}},
      {"name": "part", "shell": {"mesh": "bay.stl"}}],
    "hands": [{"body": "part", "path": "hand.csv"}]})");
}

inline Json full_scene() {
  return Json::parse(R"({"hapsix": 1, "name": "all keys", "about": "every one", "units": "mm",
    "bodies": [
      {"name": "bay", "fixed": true,
       "field": {"mesh": "bay.stl", "voxels": 1024, "offset": 0.5, "sign": "flood",
                 "cavities": "hollow", "seal": 2.5, "units": "in", "band_voxels": 4, "padding_voxels": 9}},
      {"name": "wall", "fixed": true, "field": {"mesh": "bay.stl", "voxel_size": 0.25}},
      {"name": "old", "fixed": true, "field": {"file": "baked.vdb"}},
      {"name": "part", "mass": 0.25, "com": [1, 2, 3],
       "inertia": [3e-4, 2e-4, 4e-4, 1e-5, -2e-5, 3e-5],
       "pose": {"p": [10, -20, 30], "q": [0, 0.6, 0.8, 0]},
       "shell": {"mesh": "bay.stl", "points": 777, "levels": 5, "seed": 42, "units": "cm",
                 "surface": "field", "normals": "triangles", "voxels": 96, "offset": 0.5,
                 "seal": 1.5}},
      {"name": "other", "translation_only": true, "shell": {"mesh": "bay.stl", "spacing": 0.75, "voxel_size": 0.25}},
      {"name": "third", "shell": {"file": "part.ply"}}],
    "contact": {"method": "gauss6+facing+product+geodesic", "stiffness": 2e4, "damping": 2e-3,
                "global_n0": 7, "epsilon": 0.02, "epsilon_normal": 0.03,
                "epsilon_torque": 0.9, "torque_length": 1.5,
                "series_c": 3, "margin_voxels": 0.25, "cluster_voxels": 0.75,
                "passivity": true},
    "coupling": {"mode": "static", "stiffness": 1500, "rotational_stiffness": 0.7,
                 "damping_ratio": 0.8, "max_depth_voxels": 0.4, "max_force": 3, "max_torque": 0.2,
                 "max_step_voxels": 0.3},
    "integrator": "explicit", "gradient": "exact", "rate": 2000, "duration": 1.25,
    "net_stiffness": true,
    "hands": [{"body": "part", "device": "arm", "path": "hand.csv", "mode": "pseudo-admittance",
               "motion_scale": 2, "rotation_scale": 1.5, "force_scale": 0.5, "relative": true,
               "clutch_buttons": 5, "manipulandum_mass": 0.2, "driver_stiffness": 900,
               "driver_damping": 4, "admittance_damping": 6, "passivity": true,
               "safety": {"max_force": 3.5, "max_torque": 0.25, "max_force_rate": 700,
                 "max_torque_rate": 70, "max_power": 1.5, "max_speed": 0.5, "derate_speed": 0.75,
                 "cut_speed": 1.25, "soft_start": 0.5, "decay_time": 0.01, "pose_jump": 8,
                 "freeze_time": 0.25, "dead_man_buttons": 6},
               "arm": {"delay_frames": 2, "mass": 0.31, "inertia": 4e-4, "damping": 1.1,
                 "rotational_damping": 2e-3, "position_step": 0.02, "angle_step": 2e-4,
                 "force_step": 0.03, "torque_step": 2e-3, "velocity": "exact",
                 "velocity_filter": 150, "workspace": [[-90, -80, -70], [100, 110, 120]],
                 "stop_stiffness": 1e4, "max_force": 20, "max_torque": 2, "max_velocity": 1.5,
                 "servo_frequency": 80, "person_mass": 0.5, "person_inertia": 2e-3,
                 "person_stiffness": 400, "person_damping": 15, "person_rotational_stiffness": 2,
                 "person_rotational_damping": 0.2, "grip_stiffness": 1400, "grip_damping": 7,
                 "grip_rotational_stiffness": 4, "grip_rotational_damping": 0.03}},
              {"body": "other", "device": "simulated"}],
    "verdict": {"forbidden": [{"box": [[-1, -2, -3], [1, 2, 3]]}],
                "target": {"pose": {"p": [5, 6, 7], "q": [1, 0, 0, 0]}, "tolerance": 2,
                           "tolerance_angle": 0.1}}})");
}

inline void check_close(double a, double b) { CHECK(a == h6::test::near(b).epsilon(1e-12)); }

inline void check_same(const h6Vec3& a, const h6Vec3& b) {
  check_close(a.x, b.x);
  check_close(a.y, b.y);
  check_close(a.z, b.z);
}

inline void check_same(const h6Pose& a, const h6Pose& b) {
  check_same(a.p, b.p);
  check_close(a.q.w, b.q.w);
  check_same(h6Vec3{a.q.x, a.q.y, a.q.z}, h6Vec3{b.q.x, b.q.y, b.q.z});
}

inline void check_same(const h6ContactDef& a, const h6ContactDef& b) {
  CHECK(a.method == b.method);
  if (a.method != H6_METHOD_ROBUST) CHECK(a.pieces == b.pieces);
  const double xs[] = {a.stiffness,      a.damping,        a.global_n0,     a.epsilon,
                       a.epsilon_normal, a.epsilon_torque, a.torque_length, a.series_c,
                       a.margin_voxels,  a.cluster_voxels};
  CHECK(a.passivity == b.passivity);
  const double ys[] = {b.stiffness,      b.damping,        b.global_n0,     b.epsilon,
                       b.epsilon_normal, b.epsilon_torque, b.torque_length, b.series_c,
                       b.margin_voxels,  b.cluster_voxels};
  for (int i = 0; i < 10; ++i) check_close(xs[i], ys[i]);
}

inline void check_same(const h6CouplingDef& a, const h6CouplingDef& b) {
  const double xs[] = {a.stiffness, a.rotational_stiffness, a.damping_ratio,  a.max_depth_voxels,
                       a.max_force, a.max_torque,           a.max_step_voxels};
  const double ys[] = {b.stiffness, b.rotational_stiffness, b.damping_ratio,  b.max_depth_voxels,
                       b.max_force, b.max_torque,           b.max_step_voxels};
  CHECK(a.mode == b.mode);
  for (int i = 0; i < 7; ++i) check_close(xs[i], ys[i]);
}

inline void check_same(const SceneArm& a, const SceneArm& b) {
  CHECK(a.delay_frames == b.delay_frames);
  CHECK(a.exact_velocity == b.exact_velocity);
  for (const ArmNumber& key : arm_numbers()) {
    INFO(key.name);
    check_close(a.*key.value, b.*key.value);
  }
  check_same(a.workspace_min, b.workspace_min);
  check_same(a.workspace_max, b.workspace_max);
}

// What the scene says of a hand: body and coupling stand elsewhere.
inline void check_same(const h6HandDef& a, const h6HandDef& b) {
  CHECK(a.mode == b.mode);
  CHECK(a.passivity == b.passivity);
  CHECK(a.filter.relative == b.filter.relative);
  CHECK(a.filter.clutch_buttons == b.filter.clutch_buttons);
  check_close(a.filter.motion_scale, b.filter.motion_scale);
  check_close(a.filter.rotation_scale, b.filter.rotation_scale);
  check_close(a.filter.force_scale, b.filter.force_scale);
  check_close(a.manipulandum_mass, b.manipulandum_mass);
  check_close(a.driver_stiffness, b.driver_stiffness);
  check_close(a.driver_damping, b.driver_damping);
  check_close(a.admittance_damping, b.admittance_damping);
  const auto limits = [](const h6SafetyDef& d) {
    return std::vector<double>{d.max_force,
                               d.max_torque,
                               d.max_force_rate,
                               d.max_torque_rate,
                               d.max_power,
                               d.max_speed,
                               d.derate_speed,
                               d.cut_speed,
                               d.soft_start,
                               d.decay_time,
                               d.pose_jump,
                               d.freeze_time,
                               static_cast<double>(d.dead_man_buttons)};
  };
  const std::vector<double> la = limits(a.safety), lb = limits(b.safety);
  for (std::size_t i = 0; i < la.size(); ++i) check_close(la[i], lb[i]);
}

inline void check_same(const SceneVerdict& a, const SceneVerdict& b) {
  REQUIRE(a.forbidden.size() == b.forbidden.size());
  for (std::size_t i = 0; i < a.forbidden.size(); ++i) {
    check_same(a.forbidden[i].low, b.forbidden[i].low);
    check_same(a.forbidden[i].high, b.forbidden[i].high);
  }
  REQUIRE(a.target.has_value() == b.target.has_value());
  if (a.target) check_same(*a.target, *b.target);
  check_close(a.tolerance, b.tolerance);
  check_close(a.tolerance_angle, b.tolerance_angle);
}

inline void check_same(const SceneBody& a, const SceneBody& b) {
  CHECK(a.name == b.name);
  CHECK(a.fixed == b.fixed);
  if (!a.fixed) check_close(a.mass, b.mass);
  CHECK(a.translation_only == b.translation_only);
  check_same(a.pose, b.pose);
  REQUIRE(a.com.has_value() == b.com.has_value());
  if (a.com) check_same(*a.com, *b.com);
  REQUIRE(a.inertia.has_value() == b.inertia.has_value());
  if (a.inertia)
    for (int i = 0; i < 6; ++i) check_close((*a.inertia)[i], (*b.inertia)[i]);
  REQUIRE(a.field.has_value() == b.field.has_value());
  if (a.field) {
    const FieldBake &x = a.field->bake, &y = b.field->bake;
    if (x.voxel_size == 0) CHECK(x.voxels == y.voxels);
    check_close(x.voxel_size, y.voxel_size);
    check_close(x.offset, y.offset);
    CHECK(x.sign == y.sign);
    CHECK(x.cavities == y.cavities);
    check_close(x.band_voxels, y.band_voxels);
    CHECK(x.padding_voxels == y.padding_voxels);
  }
  REQUIRE(a.shell.has_value() == b.shell.has_value());
  if (a.shell && !a.shell->points) {
    const ShellBake &x = a.shell->bake, &y = b.shell->bake;
    if (x.spacing == 0) CHECK(x.points == y.points);
    check_close(x.spacing, y.spacing);
    CHECK(x.levels == y.levels);
    CHECK(x.seed == y.seed);
    CHECK(x.surface == y.surface);
    CHECK(x.normals == y.normals);
    if (x.field.voxel_size == 0) CHECK(x.field.voxels == y.field.voxels);
    check_close(x.field.voxel_size, y.field.voxel_size);
    check_close(x.field.offset, y.field.offset);
    check_close(x.field.seal, y.field.seal);
  }
}

// All that a scene says, sources of meshes and shells aside.
inline void check_same(const Scene& a, const Scene& b) {
  CHECK(a.name == b.name);
  CHECK(a.about == b.about);
  CHECK(a.unit == b.unit);
  REQUIRE(a.bodies.size() == b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) check_same(a.bodies[i], b.bodies[i]);
  check_same(a.contact, b.contact);
  check_same(a.coupling, b.coupling);
  CHECK(a.integrator == b.integrator);
  CHECK(a.gradient == b.gradient);
  check_close(a.rate, b.rate);
  check_close(a.duration, b.duration);
  CHECK(a.net_stiffness == b.net_stiffness);
  REQUIRE(a.hands.size() == b.hands.size());
  for (std::size_t i = 0; i < a.hands.size(); ++i) {
    const SceneHand &x = a.hands[i], &y = b.hands[i];
    CHECK(x.body == y.body);
    CHECK(x.device == y.device);
    check_same(x.def, y.def);
    REQUIRE(x.arm.has_value() == y.arm.has_value());
    if (x.arm) check_same(*x.arm, *y.arm);
    REQUIRE(x.path.size() == y.path.size());
    for (std::size_t r = 0; r < x.path.size(); ++r) {
      check_close(x.path[r].t, y.path[r].t);
      check_same(x.path[r].pose, y.path[r].pose);
    }
  }
  check_same(a.verdict, b.verdict);
}

}  // namespace h6::io
