// SPDX-License-Identifier: Apache-2.0
// scene_settings.cpp - the tables of settings of a scene.
#include "io/scene/scene_settings.h"

#include <algorithm>

#include "io/mesh/mesh_file.h"
#include "runtime/settings/engine_settings.h"

namespace h6::io {
namespace {

using Kind = SettingKind;

constexpr double kMostPoints = 10e6;  // of a shell; more would cost gigabytes
constexpr double kMostBoxes = 1024;
constexpr double kExactIntegers = 9007199254740992.0;  // 2^53, as JSON numbers are doubles

// Rows whose default is the initialiser of the member in C++.
template <auto M>
constexpr double start_of() {
  return static_cast<double>(typename MemberTraits<M>::Def{}.*M);
}
template <auto M>
constexpr Setting number(const char* name, const char* unit, Range range, const char* about) {
  return h6::number<M>(name, unit, start_of<M>(), range, about);
}
template <auto M>
constexpr Setting whole(const char* name, Range range, const char* about) {
  return h6::whole<M>(name, start_of<M>(), range, about);
}
template <auto M>
constexpr Setting choice(const char* name, std::span<const Choice> choices, const char* about) {
  return h6::choice<M>(name, choices, start_of<M>(), about);
}

// Rows without a member: read.cpp and write.cpp handle them.
constexpr Setting by_hand(const char* name, Kind kind, const char* about) {
  return {.name = name, .kind = kind, .member = {}, .about = about};
}
constexpr Setting list(const char* name, const SettingTable& inside, double least, double most,
                       const char* about) {
  Setting row = by_hand(name, Kind::list, about);
  row.inside = &inside, row.range = between(least, most);
  return row;
}
constexpr Setting object(const char* name, const SettingTable& inside, const char* about) {
  Setting row = by_hand(name, Kind::object, about);
  row.inside = &inside;
  return row;
}

// A size that a user can give in place of another. A value of 0 or less means that it is not given.
constexpr Setting in_place_of(const char* other, Setting row) {
  row.quiet = true, row.replaces = other;
  return row;
}

// The engine's row, with a member of a scene's struct in place of the engine's.
template <auto M>
Setting same(const SettingTable& rows, const char* name) {
  Setting row = setting_named(rows, name);
  row.member = member<M>();
  return row;
}

const Choice kUnits[] = {
    {unit_name(Unit::m), static_cast<int>(Unit::m)},
    {unit_name(Unit::mm), static_cast<int>(Unit::mm)},
    {unit_name(Unit::cm), static_cast<int>(Unit::cm)},
    {unit_name(Unit::in), static_cast<int>(Unit::in)},
};
Setting units_of_the_mesh() {
  Setting row = by_hand("units", Kind::choice, "of the mesh file; default: the scene's");
  row.choices = kUnits;
  return row;
}
const Setting kMeshRow =
    by_hand("mesh", Kind::text, "triangle mesh (STL, OBJ, PLY, glTF, COLLADA, .gz) to bake");

constexpr Choice kSigns[] = {{"auto", static_cast<int>(SignMode::automatic)},
                             {"flood", static_cast<int>(SignMode::flood)},
                             {"winding", static_cast<int>(SignMode::winding)}};
constexpr Choice kCavities[] = {{"solid", static_cast<int>(Cavities::solid)},
                                {"hollow", static_cast<int>(Cavities::hollow)}};
constexpr Setting kFieldBakeRows[] = {
    whole<&FieldBake::voxels>("voxels", between(16, 2048), "cells on the longest padded side"),
    in_place_of("voxels", number<&FieldBake::voxel_size>("voxel_size", "m", positive(kNoLimit),
                                                         "size of a cell, instead of voxels")),
    in_place_of("voxels",
                number<&FieldBake::tolerance>("tolerance", "m", positive(kNoLimit),
                                              "largest error near the surface, instead of voxels")),
    quiet(number<&FieldBake::offset>(
        "offset", "m", not_negative(kNoLimit),
        "sigma, how far the surface is pushed out; default 0 for closed meshes, else 0.9 voxel")),
    choice<&FieldBake::sign>("sign", kSigns, "how the inside is found"),
    choice<&FieldBake::cavities>("cavities", kCavities, "what enclosed hollows are"),
    quiet(number<&FieldBake::seal>("seal", "m", not_negative(kNoLimit),
                                   "holes of an open mesh up to this width are closed; 0: none")),
    number<&FieldBake::weld>("weld", "voxel", between(0, 1),
                             "vertices of open edges this near to each other are welded if this "
                             "closes the mesh"),
    in_place_of("weld", number<&FieldBake::weld_length>("weld_length", "m", positive(kNoLimit),
                                                        "the same as a length, at most a voxel")),
    number<&FieldBake::band_voxels>("band_voxels", "voxel", between(1, kWidestBand),
                                    "every cell nearer than this to the surface gets samples; "
                                    "deeper, depth is only bounded"),
    whole<&FieldBake::padding_voxels>("padding_voxels", between(1, 256),
                                      "empty cells around the mesh")};
constexpr SettingTable kFieldBake = settings_of("FieldBake", kFieldBakeRows);

// Options of the field that tells a shell's bake which parts of the surface the outside reaches.
constexpr Setting kOutsideRows[] = {
    whole<&FieldBake::voxels>(
        "voxels", between(16, 2048),
        "of the field that tells what the outside reaches: cells on the longest padded side"),
    in_place_of("voxels", number<&FieldBake::voxel_size>("voxel_size", "m", positive(kNoLimit),
                                                         "size of its cells, instead of voxels")),
    quiet(number<&FieldBake::offset>(
        "offset", "m", not_negative(kNoLimit),
        "sigma of that field; default 0 for closed meshes, else 0.9 voxel")),
    quiet(number<&FieldBake::seal>(
        "seal", "m", not_negative(kNoLimit),
        "holes of an open mesh up to this width lead nowhere; 0: all lead inside"))};
constexpr SettingTable kOutside = settings_of("FieldBake", kOutsideRows);

const Choice kSurfaces[] = {
    {name_of(ShellSurface::automatic), static_cast<int>(ShellSurface::automatic)},
    {name_of(ShellSurface::triangles), static_cast<int>(ShellSurface::triangles)},
    {name_of(ShellSurface::field), static_cast<int>(ShellSurface::field)}};
const Choice kNormals[] = {
    {name_of(ShellNormals::automatic), static_cast<int>(ShellNormals::automatic)},
    {name_of(ShellNormals::triangles), static_cast<int>(ShellNormals::triangles)},
    {name_of(ShellNormals::field), static_cast<int>(ShellNormals::field)}};
const Setting kShellBakeRows[] = {
    whole<&ShellBake::points>("points", between(1, kMostPoints), "on the finest level"),
    in_place_of("points", number<&ShellBake::spacing>("spacing", "m", positive(kNoLimit),
                                                      "least distance between points, instead of "
                                                      "points")),
    in_place_of("points", number<&ShellBake::tolerance>(
                              "tolerance", "m", positive(kNoLimit),
                              "no flat obstacle enters farther between points, instead of points; "
                              "spacing then bounds how far apart they are")),
    whole<&ShellBake::levels>("levels", between(1, 16), "nested levels"),
    whole<&ShellBake::seed>("seed", between(0, kExactIntegers), "of the sampling"),
    choice<&ShellBake::surface>(
        "surface", kSurfaces,
        "where points lie: triangles, field (where the mesh's own field is zero, in soups the "
        "offset outside of the triangles) or auto (triangles)"),
    choice<&ShellBake::normals>("normals", kNormals,
                                "of the triangles, of the field, or auto (as the points)"),
    h6::object<&ShellBake::field>("", kOutside, "how the outside is found")};
const SettingTable kShellBake = settings_of("ShellBake", kShellBakeRows);

const Setting kFieldRows[] = {
    kMeshRow, by_hand("file", Kind::text, "baked field (.vdb), in metres; instead of mesh"),
    units_of_the_mesh(), h6::object<&FieldSource::bake>("", kFieldBake, "how the mesh is baked")};
const SettingTable kField = settings_of("FieldSource", kFieldRows);
const Setting kShellRows[] = {
    kMeshRow, by_hand("file", Kind::text, "baked shell (.ply), in metres; instead of mesh"),
    by_hand(
        "bends", Kind::text,
        "reduced model (.h5 of 'hapsix bake deformable', in metres, in the frame of the mesh) by "
        "which the shell bends; its body is fixed, has no field and touches one other body; "
        "default: rigid"),
    units_of_the_mesh(), h6::object<&ShellSource::bake>("", kShellBake, "how the mesh is baked")};
const SettingTable kShell = settings_of("ShellSource", kShellRows);

Setting derived(Setting row, const char* about) {
  row.about = about;
  return row;
}
const Setting kBodyRows[] = {
    required(plain<&SceneBody::name>("name", Kind::text, "", "unique")),
    same<&SceneBody::fixed>(body_settings(), "fixed"),
    same<&SceneBody::mass>(body_settings(), "mass"),
    same<&SceneBody::translation_only>(body_settings(), "translation_only"),
    derived(same<&SceneBody::com>(body_settings(), "com"),
            "centre of mass, mesh frame; default: of the uniform solid"),
    derived(same<&SceneBody::inertia>(body_settings(), "inertia"),
            "xx yy zz xy xz yz about com, mesh axes; default: of the uniform solid"),
    same<&SceneBody::pose>(body_settings(), "pose"),
    object("field", kField, "what others touch"),
    object("shell", kShell, "what touches others")};
const SettingTable kBody = settings_of("SceneBody", kBodyRows);

constexpr Choice kVelocities[] = {{"filtered", 0}, {"exact", 1}};
constexpr Setting kArmRows[] = {
    whole<&SceneArm::delay_frames>("delay_frames", between(0, 2), "of the commands, in frames"),
    number<&SceneArm::mass>("mass", "kg", between(0.01, 100),
                            "of handle and links, felt at the grip"),
    number<&SceneArm::inertia>("inertia", "kg m^2", between(1e-5, 10),
                               "of handle and links, the same in all directions"),
    number<&SceneArm::damping>("damping", "N s/m", between(0, 1e4), "friction"),
    number<&SceneArm::rotational_damping>("rotational_damping", "N m s/rad", between(0, 100),
                                          "friction of turning"),
    number<&SceneArm::position_step>("position_step", "m", not_negative(kNoLimit),
                                     "of the encoders; 0: none"),
    number<&SceneArm::angle_step>("angle_step", "rad", between(0, 0.1), "of the encoders; 0: none"),
    number<&SceneArm::force_step>("force_step", "N", between(0, 10),
                                  "of the force sensor; 0: none"),
    number<&SceneArm::torque_step>("torque_step", "N m", between(0, 1),
                                   "of the force sensor; 0: none"),
    number<&SceneArm::velocity_filter>("velocity_filter", "Hz", between(10, 1e4),
                                       "corner of the low-pass of the filtered velocity"),
    number<&SceneArm::stop_stiffness>("stop_stiffness", "N/m", between(0, 1e7),
                                      "at the ends of the workspace"),
    number<&SceneArm::max_force>("max_force", "N", between(0, 1e4), "of the motors"),
    number<&SceneArm::max_torque>("max_torque", "N m", between(0, 1e3), "of the motors"),
    number<&SceneArm::max_velocity>("max_velocity", "m/s", between(0, 100),
                                    "largest that may be asked for; 0: any"),
    number<&SceneArm::servo_frequency>("servo_frequency", "Hz", between(1, 200),
                                       "admittance: natural frequency of the position servo"),
    number<&SceneArm::person_mass>("person_mass", "kg", between(1e-3, 100),
                                   "of the hand that holds the arm"),
    number<&SceneArm::person_inertia>("person_inertia", "kg m^2", between(1e-6, 10),
                                      "of the hand that holds the arm"),
    number<&SceneArm::person_stiffness>("person_stiffness", "N/m", between(0, 1e6),
                                        "of the person's arm towards the path"),
    number<&SceneArm::person_damping>("person_damping", "N s/m", between(0, 1e5),
                                      "of the person's arm towards the path"),
    number<&SceneArm::person_rotational_stiffness>("person_rotational_stiffness", "N m/rad",
                                                   between(0, 1e4), "of the person's wrist"),
    number<&SceneArm::person_rotational_damping>("person_rotational_damping", "N m s/rad",
                                                 between(0, 1e3), "of the person's wrist"),
    number<&SceneArm::grip_stiffness>("grip_stiffness", "N/m", between(0, 1e6),
                                      "between hand and handle"),
    number<&SceneArm::grip_damping>("grip_damping", "N s/m", between(0, 1e5),
                                    "between hand and handle"),
    number<&SceneArm::grip_rotational_stiffness>("grip_rotational_stiffness", "N m/rad",
                                                 between(0, 1e4), "between hand and handle"),
    number<&SceneArm::grip_rotational_damping>("grip_rotational_damping", "N m s/rad",
                                               between(0, 1e3), "between hand and handle"),
    choice<&SceneArm::exact_velocity>("velocity", kVelocities,
                                      "filtered: from differences of encoder readings"),
    plain<&SceneArm::workspace>("workspace", Kind::corners, "m",
                                "where the grip can be, world frame: low and high corner; "
                                "default: no stops")};
constexpr SettingTable kArm = settings_of("SceneArm", kArmRows);

// The rows of the engine's hand, with the driver's coupling of the default arm.
const SettingTable& hand_def() {
  static const std::vector<Setting> rows = [] {
    std::vector<Setting> out(hand_settings().begin(), hand_settings().end());
    for (Setting& row : out) {
      if (row.name == std::string("driver_stiffness")) row.start = 2000;
      if (row.name == std::string("driver_damping")) row.start = 5;
    }
    return out;
  }();
  static const SettingTable settings{hand_settings().of, rows.data(), rows.size()};
  return settings;
}
const Setting kHandRows[] = {
    required(plain<&SceneHand::body>("body", Kind::text, "", "name of the moving body it holds")),
    plain<&SceneHand::device>(
        "device", Kind::text, "",
        "path, simulated, arm, spacemouse, scripted:FILE, replay:FILE or bad-operator, with "
        "options as ?key=value&key=value ('hapsix devices' explains each); a plug-in is given "
        "with run --device; default path"),
    by_hand("path", Kind::text, "CSV t,x,y,z,qw,qx,qy,qz of the body's mesh frame"),
    h6::object<&SceneHand::def>("", hand_def(), "of the engine"),
    h6::object<&SceneHand::arm>(
        "arm", kArm, "figures of the device arm: a simulated arm and the person who holds it")};
const SettingTable kHand = settings_of("SceneHand", kHandRows);

Setting box_row() {
  Setting row = by_hand("box", Kind::corners, "low and high corner, world frame");
  row.member.get = [](const void* box) { return box; };
  row.member.make = [](void* box) { return box; };
  row.unit = "m";
  return required(row);
}
const Setting kForbiddenRows[] = {box_row()};
const SettingTable kForbidden = settings_of("Box", kForbiddenRows);
const Setting kTargetRows[] = {
    required(
        h6::object<&SceneVerdict::target>("pose", pose_settings(), "of the first hand's body")),
    required(h6::number<&SceneVerdict::tolerance>("tolerance", "m", 0, positive(kNoLimit),
                                                  "of the mesh frame's origin")),
    h6::number<&SceneVerdict::tolerance_angle>("tolerance_angle", "rad", 0, between(0, 3.2),
                                               "0: any orientation will do")};
const SettingTable kTarget = settings_of("SceneVerdict", kTargetRows);
const Setting kVerdictRows[] = {
    list("forbidden", kForbidden, 0, kMostBoxes,
         "where no shell point and no centre of mass of the first hand's body may come"),
    object("target", kTarget, "where the first hand's body should end")};
const SettingTable kVerdict = settings_of("SceneVerdict", kVerdictRows);

constexpr Choice kUpAxes[] = {{"x", static_cast<int>(UpAxis::x)},
                              {"y", static_cast<int>(UpAxis::y)},
                              {"z", static_cast<int>(UpAxis::z)}};
Setting version_row() {
  Setting row = by_hand("hapsix", Kind::whole, "version of the format: 1");
  row.range = between(1, 1);
  return required(row);
}
const Setting kSceneRows[] = {
    version_row(),
    quiet(plain<&Scene::name>("name", Kind::text, "", "default: the file's name")),
    quiet(plain<&Scene::about>("about", Kind::text, "", "a line for people")),
    h6::choice<&Scene::unit>("units", kUnits, static_cast<int>(Unit::m), "of every length"),
    quiet(h6::choice<&Scene::up>("up", kUpAxes, static_cast<int>(UpAxis::z),
                                 "the axis that points up in views; forces do not know it")),
    required(list("bodies", kBody, 1, 1000000, "at least one")),
    h6::object<&Scene::contact>("contact", contact_settings(), "contact stiffness"),
    h6::object<&Scene::coupling>("coupling", coupling_settings(),
                                 "virtual coupling between hand and body"),
    same<&Scene::integrator>(session_settings(), "integrator"),
    same<&Scene::gradient>(session_settings(), "gradient"),
    same<&Scene::rate>(session_settings(), "rate"),
    h6::number<&Scene::duration>("duration", "s", 0, between(0, 1e6),
                                 "0: to the end of the longest path"),
    same<&Scene::max_substeps>(session_settings(), "max_substeps"),
    same<&Scene::net_stiffness>(session_settings(), "net_stiffness"),
    list("hands", kHand, 0, H6_MAX_HANDS, "default none"),
    object("verdict", kVerdict, "what the run is judged by")};
const SettingTable kScene = settings_of("Scene", kSceneRows);

}  // namespace

const char* up_axis_name(UpAxis up) { return kUpAxes[static_cast<int>(up)].name; }

h6HandDef default_scene_hand() {
  h6HandDef def = h6DefaultHandDef();
  set_defaults(hand_def(), &def);
  return def;
}

const SettingTable& scene_settings() { return kScene; }
const SettingTable& scene_body_settings() { return kBody; }
const SettingTable& field_source_settings() { return kField; }
const SettingTable& shell_source_settings() { return kShell; }
const SettingTable& scene_hand_settings() { return kHand; }
const SettingTable& arm_settings() { return kArm; }
const SettingTable& forbidden_settings() { return kForbidden; }
const SettingTable& target_settings() { return kTarget; }
const SettingTable& scene_verdict_settings() { return kVerdict; }

}  // namespace h6::io
