// scene_schema.cpp - the one table of keys of a scene file, and the JSON schema printed from it.
#include <nlohmann/json.hpp>

#include "hapsix/types.h"
#include "io/scene_file.h"
#include "io/scene_keys.h"

namespace h6::io {
namespace {

using Kind = KeyKind;

template <std::size_t N>
constexpr SceneKeys keys_of(const SceneKey (&keys)[N]) {
  return {keys, N};
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
    {.name = "mesh", .kind = Kind::text, .about = "triangle mesh (STL, OBJ, PLY, .gz) to bake"},
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
    {.name = "mesh", .kind = Kind::text, .about = "triangle mesh (STL, OBJ, PLY, .gz) to bake"},
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
    {.name = "units",
     .kind = Kind::choice,
     .about = "of the mesh file; default: the scene's",
     .choices = kUnits}};
constexpr SceneKeys kShellKeys = keys_of(kShell);

constexpr SceneKey kBody[] = {
    {.name = "name", .kind = Kind::text, .about = "unique", .required = true},
    {.name = "fixed", .kind = Kind::boolean, .about = "never moves; default false"},
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
     .about = "none, global, cluster, gauss3, gauss6, robust or series, and pieces of the Gauss ones: "
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
     .above_low = true}};
constexpr SceneKeys kContactKeys = keys_of(kContact);

constexpr SceneKey kCoupling[] = {
    {.name = "mode", .kind = Kind::choice, .about = "default dynamic", .choices = "dynamic"},
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
     .high = 1e6}};
constexpr SceneKeys kCouplingKeys = keys_of(kCoupling);

constexpr SceneKey kHand[] = {
    {.name = "body",
     .kind = Kind::text,
     .about = "name of the moving body it holds",
     .required = true},
    {.name = "device", .kind = Kind::text, .about = "path, simulated, ...; default path"},
    {.name = "path",
     .kind = Kind::text,
     .about = "CSV t,x,y,z,qw,qx,qy,qz of the body's mesh frame"},
    {.name = "mode",
     .kind = Kind::choice,
     .about = "default impedance: pose in, wrench out",
     .choices = "impedance"}};
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

// ---- the schema --------------------------------------------------------------------------------

using Json = nlohmann::ordered_json;

Json numbers(std::size_t count) {
  return {
      {"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", count}, {"maxItems", count}};
}

Json schema_of(const SceneKeys& keys);

Json choices_of(const SceneKey& key) {
  Json names = Json::array();
  const std::string all = key.choices;
  for (std::size_t at = 0; at <= all.size();) {
    const std::size_t end = std::min(all.find('|', at), all.size());
    names.push_back(all.substr(at, end - at));
    at = end + 1;
  }
  return names;
}

void add_limits(const SceneKey& key, Json& out) {
  if (key.low != -kNoLimit) out[key.above_low ? "exclusiveMinimum" : "minimum"] = key.low;
  if (key.high != kNoLimit) out["maximum"] = key.high;
}

Json schema_of(const SceneKey& key) {
  Json out;
  switch (key.kind) {
    case Kind::boolean:
      out["type"] = "boolean";
      break;
    case Kind::number:
      out["type"] = "number";
      add_limits(key, out);
      break;
    case Kind::whole:
      out["type"] = "integer";
      add_limits(key, out);
      break;
    case Kind::text:
      out["type"] = "string";
      out["minLength"] = 1;
      break;
    case Kind::choice:
      out["enum"] = choices_of(key);
      break;
    case Kind::method:
      out["type"] = "string";
      out["pattern"] = "^[a-z0-9]+(\\+[a-z]+)*$";
      break;
    case Kind::vec3:
      out = numbers(3);
      add_limits(key, out["items"]);
      break;
    case Kind::inertia:
      out = numbers(6);
      break;
    case Kind::quaternion:
      out = numbers(4);
      break;
    case Kind::corners:
      out = {{"type", "array"}, {"items", numbers(3)}, {"minItems", 2}, {"maxItems", 2}};
      add_limits(key, out["items"]["items"]);
      break;
    case Kind::object:
      out = schema_of(*key.keys);
      break;
    case Kind::list:
      out = {{"type", "array"}, {"items", schema_of(*key.keys)}};
      if (key.low > 0) out["minItems"] = static_cast<int>(key.low);
      out["maxItems"] = static_cast<int>(key.high);
      break;
  }
  out["description"] = key.about;
  return out;
}

Json schema_of(const SceneKeys& keys) {
  Json properties = Json::object(), required = Json::array();
  for (const SceneKey& key : keys) {
    properties[key.name] = schema_of(key);
    if (key.required) required.push_back(key.name);
  }
  Json out = {{"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
  if (!required.empty()) out["required"] = required;
  return out;
}

}  // namespace

const SceneKeys& scene_keys() { return kSceneKeys; }

std::string scene_schema() {
  Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", "hapsix scene, version 1"}};
  out.update(schema_of(kSceneKeys));
  return out.dump(2) + "\n";
}

}  // namespace h6::io
