// SPDX-License-Identifier: Apache-2.0
// keys.cpp - the one table of keys of a scene file.
#include "io/scene/keys.h"

namespace h6::io {
namespace {

using Kind = KeyKind;

template <std::size_t N>
constexpr SceneKeys keys_of(const SceneKey (&keys)[N]) {
  return {keys, N};
}

constexpr SceneKey number(const char* name, const char* about, double low, double high) {
  return {.name = name, .kind = Kind::number, .about = about, .low = low, .high = high};
}
constexpr SceneKey whole(const char* name, const char* about, double low, double high) {
  return {.name = name, .kind = Kind::whole, .about = about, .low = low, .high = high};
}
constexpr SceneKey positive(const char* name, const char* about, double high) {
  SceneKey key = number(name, about, 0, high);
  key.above_low = true;
  return key;
}

constexpr const char* kUnits = "m|mm|cm|in";
constexpr double kMostPoints = 10e6;  // of a shell: more is a mistake, and costs gigabytes

constexpr SceneKey kPose[] = {
    {.name = "p",
     .kind = Kind::vec3,
     .about = "position of the mesh frame, scene units",
     .low = -kFarthest,
     .high = kFarthest},
    {.name = "q", .kind = Kind::quaternion, .about = "orientation w x y z, unit; default 1 0 0 0"}};
constexpr SceneKeys kPoseKeys = keys_of(kPose);

constexpr SceneKey kField[] = {
    {.name = "mesh",
     .kind = Kind::text,
     .about = "triangle mesh (STL, OBJ, PLY, glTF, COLLADA, .gz) to bake"},
    {.name = "file", .kind = Kind::text, .about = "baked field (.vdb), metres; instead of mesh"},
    {.name = "voxels",
     .kind = Kind::whole,
     .about = "cells on the longest padded side; default 256",
     .low = 16,
     .high = 2048},
    {.name = "voxel_size",
     .kind = Kind::number,
     .about = "instead of voxels, scene units",
     .low = 0,
     .high = kFarthest,
     .above_low = true},
    {.name = "offset",
     .kind = Kind::number,
     .about = "sigma, how far the surface is pushed out, scene units; default 0 for closed meshes, "
              "else 0.9 voxel",
     .low = 0,
     .high = kFarthest},
    {.name = "sign",
     .kind = Kind::choice,
     .about = "how inside is found; default auto",
     .choices = "auto|flood"},
    {.name = "cavities",
     .kind = Kind::choice,
     .about = "enclosed hollows; default solid",
     .choices = "solid|hollow"},
    {.name = "seal",
     .kind = Kind::number,
     .about = "holes of an open mesh up to this width are closed, scene units; default 0: none",
     .low = 0,
     .high = kFarthest},
    {.name = "units",
     .kind = Kind::choice,
     .about = "of the mesh file; default: the scene's",
     .choices = kUnits},
    {.name = "band_voxels",
     .kind = Kind::number,
     .about = "every cell nearer than this to the surface gets samples; default 3",
     .low = 1,
     .high = 64},
    {.name = "padding_voxels",
     .kind = Kind::whole,
     .about = "empty cells around the mesh; default 8",
     .low = 1,
     .high = 256}};
constexpr SceneKeys kFieldKeys = keys_of(kField);

constexpr SceneKey kShell[] = {
    {.name = "mesh",
     .kind = Kind::text,
     .about = "triangle mesh (STL, OBJ, PLY, glTF, COLLADA, .gz) to bake"},
    {.name = "file", .kind = Kind::text, .about = "baked shell (.ply), metres; instead of mesh"},
    {.name = "points",
     .kind = Kind::whole,
     .about = "on the finest level; default 10000",
     .low = 1,
     .high = kMostPoints},
    {.name = "spacing",
     .kind = Kind::number,
     .about = "instead of points: least distance between them, scene units",
     .low = 0,
     .high = kFarthest,
     .above_low = true},
    {.name = "levels",
     .kind = Kind::whole,
     .about = "nested levels; default 7",
     .low = 1,
     .high = 16},
    {.name = "seed",
     .kind = Kind::whole,
     .about = "of the sampling; default 1",
     .low = 0,
     .high = 9007199254740992.0},
    {.name = "surface",
     .kind = Kind::choice,
     .about =
         "where points lie: triangles, field (where the mesh's own field is zero, in soups the "
         "offset outside of the triangles) or auto (default: triangles)",
     .choices = "auto|triangles|field"},
    {.name = "normals",
     .kind = Kind::choice,
     .about = "of the triangles, of the field, or auto (default: as the points)",
     .choices = "auto|triangles|field"},
    {.name = "voxels",
     .kind = Kind::whole,
     .about = "of the field that tells what the outside reaches, on the longest padded side; "
              "default 256",
     .low = 16,
     .high = 2048},
    {.name = "voxel_size",
     .kind = Kind::number,
     .about = "instead of voxels, scene units",
     .low = 0,
     .high = kFarthest,
     .above_low = true},
    {.name = "offset",
     .kind = Kind::number,
     .about = "sigma of that field, scene units; default 0 for closed meshes, else 0.9 voxel",
     .low = 0,
     .high = kFarthest},
    {.name = "seal",
     .kind = Kind::number,
     .about = "holes of an open mesh up to this width lead nowhere, scene units; default 0: all do",
     .low = 0,
     .high = kFarthest},
    {.name = "units",
     .kind = Kind::choice,
     .about = "of the mesh file; default: the scene's",
     .choices = kUnits}};
constexpr SceneKeys kShellKeys = keys_of(kShell);

constexpr SceneKey kBody[] = {
    {.name = "name", .kind = Kind::text, .about = "unique", .required = true},
    {.name = "fixed", .kind = Kind::boolean, .about = "never moves; default false"},
    {.name = "translation_only",
     .kind = Kind::boolean,
     .about = "3-DoF: never turns and feels no torque; default false"},
    {.name = "mass",
     .kind = Kind::number,
     .about = "kg; default 0.1",
     .low = 0,
     .high = 1e6,
     .above_low = true},
    {.name = "com",
     .kind = Kind::vec3,
     .about = "centre of mass, mesh frame, scene units; default: of the uniform solid",
     .low = -kFarthest,
     .high = kFarthest},
    {.name = "inertia",
     .kind = Kind::inertia,
     .about = "xx yy zz xy xz yz about com, mesh axes, kg m^2; default: of the uniform solid"},
    {.name = "pose",
     .kind = Kind::object,
     .about = "mesh frame to world at the start",
     .keys = &kPoseKeys},
    {.name = "field", .kind = Kind::object, .about = "what others touch", .keys = &kFieldKeys},
    {.name = "shell", .kind = Kind::object, .about = "what touches others", .keys = &kShellKeys}};
constexpr SceneKeys kBodyKeys = keys_of(kBody);

constexpr SceneKey kContact[] = {
    {.name = "method",
     .kind = Kind::method,
     .about =
         "none, global, cluster, gauss3, gauss6, robust or series, and pieces of the Gauss ones: "
         "+facing, +depth, +product, +cluster, +geodesic, +handles, +printed; default robust"},
    {.name = "stiffness",
     .kind = Kind::number,
     .about = "k, N/m; default 1e4",
     .low = 0,
     .high = 1e9,
     .above_low = true},
    {.name = "damping",
     .kind = Kind::number,
     .about = "beta, s; default 1e-3",
     .low = 0,
     .high = 1},
    {.name = "global_n0",
     .kind = Kind::number,
     .about = "global: contacts from which the stiffness is shared; default 10",
     .low = 1,
     .high = 1e6},
    {.name = "epsilon",
     .kind = Kind::number,
     .about = "gauss3, gauss6: half-width of the hat",
     .low = 0,
     .high = 2,
     .above_low = true},
    {.name = "epsilon_normal",
     .kind = Kind::number,
     .about = "robust: half-width over normals",
     .low = 0,
     .high = 2,
     .above_low = true},
    {.name = "epsilon_torque",
     .kind = Kind::number,
     .about = "robust: half-width over torque directions",
     .low = 0,
     .high = 2,
     .above_low = true},
    {.name = "torque_length",
     .kind = Kind::number,
     .about =
         "l0, arms below it count for less, scene units; default 0: one voxel for robust, none "
         "for others",
     .low = 0,
     .high = kFarthest},
    {.name = "series_c",
     .kind = Kind::number,
     .about = "series: net stiffness is at most this times k, above 2; default 4",
     .low = 2,
     .high = 1e6,
     .above_low = true},
    {.name = "margin_voxels",
     .kind = Kind::number,
     .about = "series: points nearer than this take part before they touch; default 0.5",
     .low = 0,
     .high = 2},
    {.name = "cluster_voxels",
     .kind = Kind::number,
     .about = "cluster, +cluster: contacts nearer than this are one; default 0.5",
     .low = 0.01,
     .high = 100,
     .above_low = true},
    {.name = "passivity",
     .kind = Kind::boolean,
     .about = "observe the work of the contacts and damp what they would make out of nothing; "
              "default false"}};
constexpr SceneKeys kContactKeys = keys_of(kContact);

constexpr SceneKey kCoupling[] = {
    {.name = "mode",
     .kind = Kind::choice,
     .about = "dynamic: a body with mass; static: each frame one step towards balance; direct: no "
              "coupling, the body is where the hand is; default dynamic",
     .choices = "dynamic|static|direct"},
    {.name = "stiffness",
     .kind = Kind::number,
     .about = "k_VC, N/m; default 1e3",
     .low = 0,
     .high = 1e9,
     .above_low = true},
    {.name = "rotational_stiffness",
     .kind = Kind::number,
     .about = "N m/rad; default 0: stiffness times (30 voxels) squared",
     .low = 0,
     .high = 1e9},
    {.name = "damping_ratio",
     .kind = Kind::number,
     .about = "default 1: critical",
     .low = 0,
     .high = 10},
    {.name = "max_depth_voxels",
     .kind = Kind::number,
     .about = "x_max: the largest force is contact stiffness times it; default 0.5",
     .low = 0,
     .high = 1000,
     .above_low = true},
    {.name = "max_force",
     .kind = Kind::number,
     .about = "N; default 0: from max_depth_voxels",
     .low = 0,
     .high = 1e6},
    {.name = "max_torque",
     .kind = Kind::number,
     .about = "N m; default 0: max_force times the body's radius",
     .low = 0,
     .high = 1e6},
    {.name = "max_step_voxels",
     .kind = Kind::number,
     .about = "static: no point moves farther than this in a frame; default 0.5",
     .low = 0,
     .high = 1000,
     .above_low = true}};
constexpr SceneKeys kCouplingKeys = keys_of(kCoupling);

constexpr SceneKey kArm[] = {
    whole("delay_frames", "of the commands, in frames: 0 (default), 1 or 2", 0, 2),
    number("mass", "of handle and links, felt at the grip, kg; default 0.3", 0.01, 100),
    number("inertia", "the same in all directions, kg m^2; default 3e-4", 1e-5, 10),
    number("damping", "friction, N s/m; default 1", 0, 1e4),
    number("rotational_damping", "friction, N m s/rad; default 1e-3", 0, 100),
    number("position_step", "of the encoders, scene units; 0: none; default 0.01 mm", 0, kFarthest),
    number("angle_step", "of the encoders, rad; 0: none; default 1e-4", 0, 0.1),
    number("force_step", "of the force sensor, N; 0: none; default 0.01", 0, 10),
    number("torque_step", "of the force sensor, N m; 0: none; default 1e-3", 0, 1),
    {.name = "velocity",
     .kind = Kind::choice,
     .about = "filtered: from differences of what the encoders say; default filtered",
     .choices = "filtered|exact"},
    number("velocity_filter", "corner of that low-pass, Hz; default 200", 10, 1e4),
    {.name = "workspace",
     .kind = Kind::corners,
     .about = "low and high corner of where the grip can be, world, scene units; default no stops",
     .low = -kFarthest,
     .high = kFarthest},
    number("stop_stiffness", "at the ends of the workspace, N/m; default 2e4", 0, 1e7),
    number("max_force", "of the motors, N; default 30", 0, 1e4),
    number("max_torque", "of the motors, N m; default 3", 0, 1e3),
    number("max_velocity", "that it may be asked for, m/s; 0: any; default 2", 0, 100),
    number("servo_frequency",
           "admittance: natural frequency of the position servo, Hz; default 100", 1, 200),
    number("person_mass", "of the hand that holds it, kg; default 0.4", 1e-3, 100),
    number("person_inertia", "kg m^2; default 1e-3", 1e-6, 10),
    number("person_stiffness", "of the arm towards the path, N/m; default 500", 0, 1e6),
    number("person_damping", "N s/m; default 20", 0, 1e5),
    number("person_rotational_stiffness", "N m/rad; default 3", 0, 1e4),
    number("person_rotational_damping", "N m s/rad; default 0.1", 0, 1e3),
    number("grip_stiffness", "between hand and handle, N/m; default 1500", 0, 1e6),
    number("grip_damping", "N s/m; default 8", 0, 1e5),
    number("grip_rotational_stiffness", "N m/rad; default 5", 0, 1e4),
    number("grip_rotational_damping", "N m s/rad; default 0.02", 0, 1e3)};
constexpr SceneKeys kArmKeys = keys_of(kArm);

constexpr SceneKey kSafety[] = {
    number("max_force", "N; default 0: the device's rating", 0, 1e4),
    number("max_torque", "N m; default 0: the device's rating", 0, 1e3),
    number("max_force_rate", "slew limit, N/s; default 0: the device's", 0, 1e7),
    number("max_torque_rate", "slew limit, N m/s; default 0: the device's", 0, 1e6),
    number("max_power", "that the hand may be given, W; default 0: max_force at 1 m/s", 0, 1e5),
    number("max_speed", "admittance modes, m/s; default 0: the device's", 0, 100),
    number(
        "derate_speed",
        "of the hand, m/s: from here on the force falls, to nothing at cut_speed; default 0: half "
        "of that",
        0, 100),
    number("cut_speed", "of the hand, m/s: zero, latched; default 0: from the device", 0, 100),
    number("soft_start", "from nothing to the whole output after arming, s; default 0.1", 0, 10),
    number("decay_time", "from the whole output to nothing in trouble, s; default 0.02", 0.001,
           0.02),
    number("pose_jump",
           "a pose farther from the last one is a jump, 1 to 50 mm, scene units; default 20 mm", 0,
           kFarthest),
    number(
        "freeze_time",
        "samples that stay the same for so long mean a frozen device, s; default 0: the device's",
        0, 1),
    whole("dead_man_buttons",
          "bits: nothing is rendered unless one of these buttons is held; default 0: none", 0,
          4294967295.0)};
constexpr SceneKeys kSafetyKeys = keys_of(kSafety);

constexpr SceneKey kHand[] = {
    {.name = "body",
     .kind = Kind::text,
     .about = "name of the moving body it holds",
     .required = true},
    {.name = "device",
     .kind = Kind::text,
     .about =
         "path, simulated, arm, spacemouse, scripted:FILE, replay:FILE or bad-operator, with "
         "options as ?key=value&key=value ('hapsix devices' explains each); a plug-in is given "
         "with run --device; default path"},
    {.name = "path",
     .kind = Kind::text,
     .about = "CSV t,x,y,z,qw,qx,qy,qz of the body's mesh frame"},
    {.name = "mode",
     .kind = Kind::choice,
     .about = "impedance: pose in, wrench out; admittance: the person's wrench in, pose out; "
              "pseudo-admittance: the driver's own coupling in, the manipulandum's pose out; "
              "default impedance",
     .choices = "impedance|admittance|pseudo-admittance"},
    positive("motion_scale",
             "metres in the scene a metre of the device; the path is the device's; default 1", 1e6),
    positive("rotation_scale", "the same for angles; default 1", 1e6),
    positive("force_scale", "newtons at the device a newton in the scene, torque alike; default 1",
             1e6),
    {.name = "relative",
     .kind = Kind::boolean,
     .about = "the first sample takes the body where it is; default false"},
    whole("clutch_buttons",
          "bits: while one of these buttons is down the device moves alone; default 0: none", 0,
          4294967295.0),
    positive("manipulandum_mass", "pseudo-admittance: of what the hand holds, kg; default 0.1",
             1e6),
    number("driver_stiffness",
           "pseudo-admittance: of the driver's coupling, N/m; default 2000; 0: the arm's own, not "
           "known to the engine",
           0, 1e5),
    number("driver_damping", "pseudo-admittance: of the driver's coupling, N s/m; default 5", 0,
           50),
    number("admittance_damping", "admittance: of the free body, N s/m; default 0: derived", 0, 1e6),
    {.name = "passivity",
     .kind = Kind::boolean,
     .about = "take back by damping what energy would leave through this hand unpaid; default "
              "false"},
    {.name = "safety",
     .kind = Kind::object,
     .about = "limits of what goes to the device, each at most the device's own rating",
     .keys = &kSafetyKeys},
    {.name = "arm",
     .kind = Kind::object,
     .about = "figures of the device arm: a simulated arm and the person who holds it",
     .keys = &kArmKeys}};
constexpr SceneKeys kHandKeys = keys_of(kHand);

constexpr SceneKey kForbidden[] = {{.name = "box",
                                    .kind = Kind::corners,
                                    .about = "[[x,y,z],[x,y,z]] low and high, world",
                                    .low = -kFarthest,
                                    .high = kFarthest,
                                    .required = true}};
constexpr SceneKeys kForbiddenKeys = keys_of(kForbidden);

constexpr SceneKey kTarget[] = {{.name = "pose",
                                 .kind = Kind::object,
                                 .about = "of the first hand's body",
                                 .required = true,
                                 .keys = &kPoseKeys},
                                {.name = "tolerance",
                                 .kind = Kind::number,
                                 .about = "scene units",
                                 .low = 0,
                                 .high = kFarthest,
                                 .above_low = true,
                                 .required = true},
                                {.name = "tolerance_angle",
                                 .kind = Kind::number,
                                 .about = "rad; default 0: any orientation will do",
                                 .low = 0,
                                 .high = 3.2}};
constexpr SceneKeys kTargetKeys = keys_of(kTarget);

constexpr SceneKey kVerdict[] = {
    {.name = "forbidden",
     .kind = Kind::list,
     .about = "where no shell point and no centre of mass of the first hand's body may come",
     .high = kMostBoxes,
     .keys = &kForbiddenKeys},
    {.name = "target",
     .kind = Kind::object,
     .about = "where the first hand's body should end",
     .keys = &kTargetKeys}};
constexpr SceneKeys kVerdictKeys = keys_of(kVerdict);

constexpr SceneKey kScene[] = {
    {.name = "hapsix",
     .kind = Kind::whole,
     .about = "version of the format: 1",
     .low = 1,
     .high = 1,
     .required = true},
    {.name = "name", .kind = Kind::text, .about = "default: the file's name"},
    {.name = "about", .kind = Kind::text, .about = "a line for people"},
    {.name = "units",
     .kind = Kind::choice,
     .about = "of every length; default m",
     .choices = kUnits},
    {.name = "bodies",
     .kind = Kind::list,
     .about = "at least one",
     .low = 1,
     .high = H6_MAX_BODIES,
     .required = true,
     .keys = &kBodyKeys},
    {.name = "contact", .kind = Kind::object, .about = "contact stiffness", .keys = &kContactKeys},
    {.name = "coupling",
     .kind = Kind::object,
     .about = "virtual coupling between hand and body",
     .keys = &kCouplingKeys},
    {.name = "integrator",
     .kind = Kind::choice,
     .about = "default implicit",
     .choices = "implicit|explicit"},
    {.name = "gradient",
     .kind = Kind::choice,
     .about = "default symmetric",
     .choices = "symmetric|exact"},
    {.name = "rate",
     .kind = Kind::number,
     .about = "frames per second; default 1000",
     .low = 100,
     .high = 10000},
    {.name = "duration",
     .kind = Kind::number,
     .about = "s; default 0: to the end of the longest path",
     .low = 0,
     .high = 1e6},
    {.name = "net_stiffness",
     .kind = Kind::boolean,
     .about = "report the extreme stiffness of all contacts together in every frame; default "
              "false"},
    {.name = "hands",
     .kind = Kind::list,
     .about = "default none",
     .high = H6_MAX_HANDS,
     .keys = &kHandKeys},
    {.name = "verdict",
     .kind = Kind::object,
     .about = "what the run is judged by",
     .keys = &kVerdictKeys}};
constexpr SceneKeys kSceneKeys = keys_of(kScene);

}  // namespace

const SceneKeys& scene_keys() { return kSceneKeys; }

const std::vector<ArmNumber>& arm_numbers() {
  static const std::vector<ArmNumber> all = {
      {"mass", &SceneArm::mass},
      {"inertia", &SceneArm::inertia},
      {"damping", &SceneArm::damping},
      {"rotational_damping", &SceneArm::rotational_damping},
      {"position_step", &SceneArm::position_step, true},
      {"angle_step", &SceneArm::angle_step},
      {"force_step", &SceneArm::force_step},
      {"torque_step", &SceneArm::torque_step},
      {"velocity_filter", &SceneArm::velocity_filter},
      {"stop_stiffness", &SceneArm::stop_stiffness},
      {"max_force", &SceneArm::max_force},
      {"max_torque", &SceneArm::max_torque},
      {"max_velocity", &SceneArm::max_velocity},
      {"servo_frequency", &SceneArm::servo_frequency},
      {"person_mass", &SceneArm::person_mass},
      {"person_inertia", &SceneArm::person_inertia},
      {"person_stiffness", &SceneArm::person_stiffness},
      {"person_damping", &SceneArm::person_damping},
      {"person_rotational_stiffness", &SceneArm::person_rotational_stiffness},
      {"person_rotational_damping", &SceneArm::person_rotational_damping},
      {"grip_stiffness", &SceneArm::grip_stiffness},
      {"grip_damping", &SceneArm::grip_damping},
      {"grip_rotational_stiffness", &SceneArm::grip_rotational_stiffness},
      {"grip_rotational_damping", &SceneArm::grip_rotational_damping}};
  return all;
}

}  // namespace h6::io
