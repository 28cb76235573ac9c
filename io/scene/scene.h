// SPDX-License-Identifier: Apache-2.0
// scene.h - a scene as data, whether it comes from a file or from a generator.
//
// Lengths are in metres here; a file has its own unit. Ranges and meanings: runtime/SETTINGS.md.
#pragma once
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/bake/bake_field.h"
#include "io/mesh/mesh_file.h"
#include "io/shell/bake_shell.h"

namespace h6::io {

// One row of a path: where the hand wants the mesh frame of its body to be at a time.
struct PathRow {
  double t;     // [s], strictly increasing
  h6Pose pose;  // unit quaternion
};
using Path = std::vector<PathRow>;

// Where a field or shell comes from. Exactly one of mesh, file or (generated scenes) mesh_data /
// points is set. `unit` is that of the file `mesh`: a baked `file` is always in metres.
struct FieldSource {
  std::filesystem::path mesh, file;
  std::optional<Mesh> mesh_data;
  FieldBake bake;
  std::optional<Unit> unit;  // of the mesh; the scene's own when not set
};
struct ShellSource {
  std::filesystem::path mesh, file;
  std::optional<Mesh> mesh_data;
  std::optional<PointCloud> points;
  ShellBake bake;
  std::optional<Unit> unit;
};

struct Box {
  h6Vec3 low, high;
};

struct SceneBody {
  std::string name;
  bool fixed = false;
  double mass = 0.1;          // [kg]
  std::optional<h6Vec3> com;  // mesh frame [m]; default: a solid if closed, else its points
  std::optional<std::array<double, 6>> inertia;  // xx yy zz xy xz yz about com [kg m^2]
  h6Pose pose{{0, 0, 0}, {1, 0, 0, 0}};
  bool translation_only = false;
  std::optional<FieldSource> field;
  std::optional<ShellSource> shell;
};

// The simulated arm of the device "arm", and the person who holds it (device/simulated_arm.h).
struct SceneArm {
  int delay_frames = 0;
  double mass = 0.3, inertia = 3e-4;               // [kg], [kg m^2]
  double damping = 1, rotational_damping = 1e-3;   // [N s/m], [N m s/rad]
  double position_step = 1e-5, angle_step = 1e-4;  // [m], [rad]
  double force_step = 0.01, torque_step = 1e-3;    // [N], [N m]
  bool exact_velocity = false;
  double velocity_filter = 200;                        // [Hz]
  Box workspace{};                                     // world frame; empty: no stops [m]
  double stop_stiffness = 2e4;                         // [N/m]
  double max_force = 30, max_torque = 3;               // [N], [N m]
  double max_velocity = 2;                             // [m/s]
  double servo_frequency = 100;                        // [Hz]
  double person_mass = 0.4, person_inertia = 1e-3;     // [kg], [kg m^2]
  double person_stiffness = 500, person_damping = 20;  // [N/m], [N s/m]
  double person_rotational_stiffness = 3, person_rotational_damping = 0.1;  // [N m/rad] ...
  double grip_stiffness = 1500, grip_damping = 8;                           // [N/m], [N s/m]
  double grip_rotational_stiffness = 5, grip_rotational_damping = 0.02;     // [N m/rad] ...
};

// The engine's default hand, but with the driver's coupling of the simulated arm.
h6HandDef default_scene_hand();

struct SceneHand {
  std::string body;
  std::string device = "path";           // "path", "simulated", "arm", or what the program knows
  Path path;                             // rows, read or generated
  std::filesystem::path path_file;       // the file they were read from
  h6HandDef def = default_scene_hand();  // `body` and `coupling` are filled in by load_scene
  std::optional<SceneArm> arm;           // default figures where there is none
};

struct SceneVerdict {
  std::vector<Box> forbidden;    // world frame [m]
  std::optional<h6Pose> target;  // of the first hand's body
  double tolerance = 0;          // of the mesh frame's origin [m]
  double tolerance_angle = 0;    // 0: any orientation will do [rad]
};

struct Scene {
  std::string name, about;
  std::string generated;       // the name make_scene knows it by; empty: from a file
  std::filesystem::path file;  // it was read from
  Unit unit = Unit::m;         // of files it is exported to
  std::vector<SceneBody> bodies;
  h6ContactDef contact = h6DefaultContactDef();
  h6CouplingDef coupling = h6DefaultCouplingDef();
  h6Integrator integrator = H6_IMPLICIT;
  h6Gradient gradient = H6_SYMMETRIC;
  double rate = 1000;
  double duration = 0;         // [s]; 0: to the end of the longest path
  bool net_stiffness = false;  // reported in every frame
  std::vector<SceneHand> hands;
  SceneVerdict verdict;
};

// The pose of a path at a time. Between rows the origin moves on a straight line and the
// orientation turns the shorter way; before the first row and after the last the path stands still.
// The path has at least one row.
h6Pose sample_path(const Path& path, double t);
// Its velocity (of the mesh frame's origin): constant between rows, zero outside.
h6Velocity sample_path_velocity(const Path& path, double t);

}  // namespace h6::io
