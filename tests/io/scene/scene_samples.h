// SPDX-License-Identifier: Apache-2.0
// scene_samples.h - scenes as JSON for tests, the files they name, and checks that two scenes are
// equal.
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

#include "io/scene/scene_file.h"
#include "io/scene/scene_settings.h"
#include "io/scene/setting_json.h"
#include "runtime/settings/engine_settings.h"

namespace h6::io {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A folder for a test. The destructor removes it.
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
    fs::remove(path / name);  // some file systems flush a file that is overwritten, which is slow
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

// Makes the files that the scenes below name, and reads scenes in their folder.
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
  return Json::parse(R"({"hapsix": 1, "name": "all keys", "about": "every one", "units": "mm", "up": "y",
    "bodies": [
      {"name": "bay", "fixed": true,
       "field": {"mesh": "bay.stl", "voxels": 1024, "offset": 0.5, "sign": "flood",
                 "cavities": "hollow", "seal": 2.5, "units": "in", "band_voxels": 4, "padding_voxels": 9}},
      {"name": "wall", "fixed": true, "field": {"mesh": "bay.stl", "voxel_size": 0.25, "weld_length": 0.01}},
      {"name": "old", "fixed": true, "field": {"file": "baked.vdb"}},
      {"name": "part", "mass": 0.25, "com": [1, 2, 3],
       "inertia": [3e-4, 2e-4, 4e-4, 1e-5, -2e-5, 3e-5],
       "pose": {"p": [10, -20, 30], "q": [0, 0.6, 0.8, 0]},
       "shell": {"mesh": "bay.stl", "points": 777, "levels": 5, "seed": 42, "units": "cm",
                 "surface": "field", "normals": "triangles", "voxels": 96, "offset": 0.5,
                 "seal": 1.5}},
      {"name": "other", "translation_only": true, "shell": {"mesh": "bay.stl", "spacing": 0.75, "voxel_size": 0.25}},
      {"name": "third", "shell": {"file": "part.ply"}},
      {"name": "cut", "fixed": true, "field": {"mesh": "bay.stl", "tolerance": 0.05}},
      {"name": "blade", "shell": {"mesh": "bay.stl", "tolerance": 0.05}}],
    "contact": {"method": "gauss6+facing+product+geodesic", "stiffness": 2e4, "damping": 2e-3,
                "global_n0": 7, "epsilon": 0.02, "epsilon_normal": 0.03,
                "epsilon_torque": 0.9, "torque_length": 1.5,
                "series_c": 3, "firmness": 30, "firmness_shallow": 5, "margin_voxels": 0.25, "cluster_voxels": 0.75,
                "fit": "tight", "fit_offset": 0.0001, "friction": 0.35,
                "passivity": true},
    "coupling": {"mode": "static", "stiffness": 1500, "rotational_stiffness": 0.7,
                 "damping_ratio": 0.8, "max_depth_voxels": 0.4, "max_force": 3, "max_torque": 0.2,
                 "max_step_voxels": 0.3},
    "integrator": "explicit", "gradient": "exact", "rate": 2000, "duration": 1.25, "max_substeps": 5,
    "net_stiffness": true,
    "hands": [{"body": "part", "device": "arm", "path": "hand.csv", "mode": "pseudo-admittance",
               "motion_scale": 2, "rotation_scale": 1.5, "force_scale": 0.5, "relative": true,
               "clutch_buttons": 5, "manipulandum_mass": 0.2, "driver_stiffness": 900,
               "driver_damping": 4, "admittance_damping": 6, "passivity": true,
               "delay_frames": 1, "delay_known": true,
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

// The rows of an arm whose value is a plain number.
inline std::vector<Setting> arm_figures() {
  std::vector<Setting> out;
  for (const Setting& row : arm_settings())
    if (row.kind == SettingKind::number) out.push_back(row);
  return out;
}

// Checks that two JSON values are equal, with numbers within 1e-12.
inline void check_close(const Json& a, const Json& b) {
  REQUIRE(a.type() == b.type());
  if (a.is_number()) return check_close(a.get<double>(), b.get<double>());
  if (!a.is_structured()) {
    CHECK(a == b);
    return;
  }
  REQUIRE(a.size() == b.size());
  for (auto x = a.begin(), y = b.begin(); x != a.end(); ++x, ++y) {
    if (a.is_object()) CHECK(x.key() == y.key());
    check_close(*x, *y);
  }
}

// Checks that every row has the same value in both structs.
inline void check_same(const SettingTable& rows, const void* a, const void* b) {
  Json x = Json::object(), y = Json::object();
  write_settings(rows, a, 1, x);
  write_settings(rows, b, 1, y);
  check_close(x, y);
}
inline void check_same(const h6ContactDef& a, const h6ContactDef& b) {
  check_same(contact_settings(), &a, &b);
}
inline void check_same(const h6CouplingDef& a, const h6CouplingDef& b) {
  check_same(coupling_settings(), &a, &b);
}
// Compares only the settings that a scene has under a hand: not its body and its coupling.
inline void check_same(const h6HandDef& a, const h6HandDef& b) {
  check_same(hand_settings(), &a, &b);
}

inline void check_same(const SceneVerdict& a, const SceneVerdict& b) {
  REQUIRE(a.forbidden.size() == b.forbidden.size());
  for (std::size_t i = 0; i < a.forbidden.size(); ++i)
    check_same(forbidden_settings(), &a.forbidden[i], &b.forbidden[i]);
  check_same(target_settings(), &a, &b);
}

inline void check_same(SceneBody a, SceneBody b) {
  if (a.fixed) b.mass = a.mass;  // the reader ignores it
  check_same(scene_body_settings(), &a, &b);
  REQUIRE(a.field.has_value() == b.field.has_value());
  if (a.field) check_same(field_source_settings(), &*a.field, &*b.field);
  REQUIRE(a.shell.has_value() == b.shell.has_value());
  if (a.shell && !a.shell->points) check_same(shell_source_settings(), &*a.shell, &*b.shell);
}

// Compares all settings of two scenes, but not their meshes and shells.
inline void check_same(const Scene& a, const Scene& b) {
  check_same(scene_settings(), &a, &b);
  REQUIRE(a.bodies.size() == b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) check_same(a.bodies[i], b.bodies[i]);
  REQUIRE(a.hands.size() == b.hands.size());
  for (std::size_t i = 0; i < a.hands.size(); ++i) {
    const SceneHand &x = a.hands[i], &y = b.hands[i];
    check_same(scene_hand_settings(), &x, &y);
    REQUIRE(x.path.size() == y.path.size());
    for (std::size_t r = 0; r < x.path.size(); ++r) {
      check_close(x.path[r].t, y.path[r].t);
      check_same(x.path[r].pose, y.path[r].pose);
    }
  }
  check_same(a.verdict, b.verdict);
}

}  // namespace h6::io
