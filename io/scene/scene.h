// SPDX-License-Identifier: Apache-2.0
// scene.h - the data of a scene, from a file or from a generator.
//
// Lengths are in metres here; a file has its own unit. runtime/SETTINGS.md gives meanings and
// ranges.
#pragma once
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/bake/bake_field.h"
#include "io/deform/reduce.h"
#include "io/mesh/mesh_file.h"
#include "io/shell/bake_shell.h"

namespace h6::io {

// One row of a path: the pose that the hand wants for the mesh frame of its body at time t.
struct PathRow {
  double t;     // [s], strictly increasing
  h6Pose pose;  // unit quaternion
};
using Path = std::vector<PathRow>;

// The source of a field or shell. Exactly one of `mesh` (a mesh file), `file` (a baked file) and,
// in generated scenes, `mesh_data` or `points` is set. `unit` belongs to `mesh`; a baked file is
// always in metres. `keep`: the cache keeps what is baked; studies bake much that is used once.
struct FieldSource {
  std::filesystem::path mesh, file;
  std::optional<Mesh> mesh_data;
  FieldBake bake;
  std::optional<Unit> unit;  // of `mesh`; if not set, the scene's unit
  bool keep = true;
};
// How a shell bends: the file of a reduced model or, in generated scenes, the solid to reduce.
struct BendSource {
  std::filesystem::path file;  // .h5, in metres, in the frame of the shell's mesh
  std::optional<SolidMesh> solid;
  ReduceOptions reduce;
};
struct ShellSource {
  std::filesystem::path mesh, file;
  std::optional<Mesh> mesh_data;
  std::optional<PointCloud> points;
  ShellBake bake;
  std::optional<BendSource> bends;
  std::optional<Unit> unit;
  bool keep = true;
};

struct Box {
  h6Vec3 low, high;
};

struct SceneBody {
  std::string name;
  bool fixed = false;
  double mass = 0.1;                             // [kg]
  std::optional<h6Vec3> com;                     // mesh frame [m]; by default load_scene derives it
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
  Box workspace{};                                     // world frame [m]; if empty, no stops
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

// The engine's default hand, with the driver's coupling of the simulated arm.
h6HandDef default_scene_hand();

struct SceneHand {
  std::string body;
  std::string device = "path";           // "path", "simulated", "arm", or see open_device.h
  Path path;                             // read from a file or generated
  std::filesystem::path path_file;       // the file of `path`
  h6HandDef def = default_scene_hand();  // load_scene fills in `body` and `coupling`
  std::optional<SceneArm> arm;           // if not set, the default arm
};

struct SceneVerdict {
  std::vector<Box> forbidden;    // world frame [m]
  std::optional<h6Pose> target;  // pose of the first hand's body
  double tolerance = 0;          // distance of the mesh frame's origin [m]
  double tolerance_angle = 0;    // [rad]; 0 accepts any orientation
};

// The axis that points up, for the eye only.
enum class UpAxis { x, y, z };
const char* up_axis_name(UpAxis up);  // "x", "y", "z"

struct Scene {
  std::string name, about;
  std::string generated;       // its name in make_scene; empty for a scene from a file
  std::filesystem::path file;  // the file that the scene was read from
  Unit unit = Unit::m;         // for export
  bool unit_is_stated = true;  // else a mesh that is far too large in metres is refused
  UpAxis up = UpAxis::z;       // for views
  std::vector<SceneBody> bodies;
  h6ContactDef contact = h6DefaultContactDef();
  h6CouplingDef coupling = h6DefaultCouplingDef();
  h6Integrator integrator = H6_IMPLICIT;
  h6Gradient gradient = H6_SYMMETRIC;
  double rate = 1000;
  double duration = 0;  // [s]; 0 means until the longest path ends
  std::uint32_t max_substeps = h6DefaultSessionDef().max_substeps;
  bool net_stiffness = false;  // whether every frame reports the net stiffness
  std::vector<SceneHand> hands;
  SceneVerdict verdict;
};

// The pose of a path at time t [s]. Between rows the origin moves on a straight line and the
// orientation turns the shorter way. Before the first row and after the last the path stands still.
// The path must have at least one row.
h6Pose sample_path(const Path& path, double t);
// The velocity of the mesh frame's origin at time t [s]: constant between rows, zero outside.
h6Velocity sample_path_velocity(const Path& path, double t);

}  // namespace h6::io
