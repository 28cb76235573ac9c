// SPDX-License-Identifier: Apache-2.0
// write.cpp - a scene as plain files: scene.json, STL meshes, PLY shells, CSV paths.
//
// Every setting is written, defaults too: the file says all that the run depends on.
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/file/write_aside.h"
#include "io/scene/keys.h"
#include "io/scene/scene_file.h"
#include "io/shell/shell_file.h"

namespace h6::io {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// A body's name as a file's: letters that every system takes.
std::string file_stem(const std::string& name) {
  std::string out;
  for (const char c : name.substr(0, 60)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_';
    out += plain ? c : '_';
  }
  return out.empty() ? "body" : out;
}

bool same_mesh(const Mesh& a, const Mesh& b) {
  const auto same = [](const Vec3& p, const Vec3& q) {
    return p.x == q.x && p.y == q.y && p.z == q.z;
  };
  return a.triangles == b.triangles && std::equal(a.vertices.begin(), a.vertices.end(),
                                                  b.vertices.begin(), b.vertices.end(), same);
}

struct WriteFailed {  // thrown inside this file only
  Failure failure;
};

void must(const Outcome& outcome) {
  if (!outcome) throw WriteFailed{outcome.failure()};
}

class SceneWriter {
 public:
  SceneWriter(const Scene& scene, const fs::path& folder)
      : scene_(scene), folder_(folder), scale_(metres(scene.unit)) {}
  // Writes no file: the text alone, naming what an export would.
  explicit SceneWriter(const Scene& scene)
      : scene_(scene), scale_(metres(scene.unit)), files_(false) {}

  Json write() {
    Json out = {{"hapsix", 1}};
    if (!scene_.name.empty()) out["name"] = scene_.name;
    if (!scene_.about.empty()) out["about"] = scene_.about;
    out["units"] = unit_name(scene_.unit);
    out["bodies"] = Json::array();
    for (const SceneBody& body : scene_.bodies) out["bodies"].push_back(body_json(body));
    out["contact"] = contact_json();
    out["coupling"] = coupling_json();
    out["integrator"] = scene_.integrator == H6_EXPLICIT ? "explicit" : "implicit";
    out["gradient"] = scene_.gradient == H6_EXACT ? "exact" : "symmetric";
    out["rate"] = scene_.rate;
    out["duration"] = scene_.duration;
    if (scene_.net_stiffness) out["net_stiffness"] = true;
    out["hands"] = Json::array();
    for (const SceneHand& hand : scene_.hands) out["hands"].push_back(hand_json(hand));
    const Json verdict = verdict_json();
    if (!verdict.empty()) out["verdict"] = verdict;
    return out;
  }

 private:
  Json lengths(const h6Vec3& v) const {
    return Json::array({v.x / scale_, v.y / scale_, v.z / scale_});
  }

  Json pose_json(const h6Pose& pose) const {
    return {{"p", lengths(pose.p)}, {"q", {pose.q.w, pose.q.x, pose.q.y, pose.q.z}}};
  }

  // A file name in the folder that no other file of this scene has.
  std::string unused(const std::string& stem, const std::string& ending) {
    std::string name = stem + ending;
    for (int n = 2; std::find(used_.begin(), used_.end(), name) != used_.end(); ++n)
      name = stem + "_" + std::to_string(n) + ending;
    used_.push_back(name);
    return name;
  }

  std::string write_mesh(const Mesh& mesh, const std::string& stem) {
    for (const auto& [written, name] : meshes_)
      if (same_mesh(*written, mesh)) return name;
    const std::string name = unused(stem, ".stl");
    if (files_) must(write_stl(folder_ / name, mesh, scene_.unit));
    meshes_.emplace_back(&mesh, name);
    return name;
  }

  std::string copy_file(const fs::path& from) {
    if (!files_) return from.string();
    for (const auto& [source, name] : copies_)
      if (source == from) return name;
    fs::path endings;  // ".stl.gz" stays together
    fs::path stem = from.filename();
    for (; stem.has_extension(); stem = stem.stem()) endings = stem.extension() += endings;
    const std::string name = unused(stem.string(), endings.string());
    std::error_code error;
    if (!fs::equivalent(from, folder_ / name, error))
      must(write_aside(folder_ / name, [&](const fs::path& aside) -> Outcome {
        std::error_code failed;
        fs::copy_file(from, aside, fs::copy_options::overwrite_existing, failed);
        if (failed) return Failure{from.string() + ": cannot be copied: " + failed.message()};
        return Done{};
      }));
    copies_.emplace_back(from, name);
    return name;
  }

  // "mesh" and its unit, when it is not the scene's.
  template <class Source>
  void mesh_json(const Source& source, const std::string& stem, Json& out) {
    if (source.mesh_data) {
      out["mesh"] = write_mesh(*source.mesh_data, stem);
    } else {
      out["mesh"] = copy_file(source.mesh);
      if (source.unit && *source.unit != scene_.unit) out["units"] = unit_name(*source.unit);
    }
  }

  Json field_json(const FieldSource& field, const std::string& stem) {
    Json out;
    if (!field.file.empty()) return {{"file", copy_file(field.file)}};
    mesh_json(field, stem, out);
    const FieldBake& bake = field.bake;
    if (bake.voxel_size > 0)
      out["voxel_size"] = bake.voxel_size / scale_;
    else
      out["voxels"] = bake.voxels;
    if (bake.offset >= 0) out["offset"] = bake.offset / scale_;
    out["sign"] = bake.sign == SignMode::flood ? "flood" : "auto";
    out["cavities"] = bake.cavities == Cavities::hollow ? "hollow" : "solid";
    if (bake.seal > 0) out["seal"] = bake.seal / scale_;
    out["band_voxels"] = bake.band_voxels;
    out["padding_voxels"] = bake.padding_voxels;
    return out;
  }

  Json shell_json(const ShellSource& shell, const std::string& stem) {
    Json out;
    if (!shell.file.empty()) return {{"file", copy_file(shell.file)}};
    if (shell.points) {
      const std::string name = unused(stem, ".ply");
      if (!files_) return {{"file", name}};
      const Result<ShellData> built = build_shell(*shell.points, shell.bake.levels);
      if (!built) throw WriteFailed{built.failure()};
      must(write_shell(folder_ / name, *built));
      return {{"file", name}};
    }
    mesh_json(shell, stem, out);
    if (shell.bake.spacing > 0)
      out["spacing"] = shell.bake.spacing / scale_;
    else
      out["points"] = shell.bake.points;
    out["levels"] = shell.bake.levels;
    out["seed"] = shell.bake.seed;
    out["surface"] = name_of(shell.bake.surface);
    out["normals"] = name_of(shell.bake.normals);
    const FieldBake& field = shell.bake.field;
    if (field.voxel_size > 0)
      out["voxel_size"] = field.voxel_size / scale_;
    else
      out["voxels"] = field.voxels;
    if (field.offset >= 0) out["offset"] = field.offset / scale_;
    if (field.seal > 0) out["seal"] = field.seal / scale_;
    return out;
  }

  Json body_json(const SceneBody& body) {
    Json out = {{"name", body.name}};
    if (body.fixed)
      out["fixed"] = true;
    else
      out["mass"] = body.mass;
    if (body.translation_only) out["translation_only"] = true;
    if (body.com) out["com"] = lengths(*body.com);
    if (body.inertia) out["inertia"] = *body.inertia;
    out["pose"] = pose_json(body.pose);
    const std::string stem = file_stem(body.name);
    if (body.field) out["field"] = field_json(*body.field, stem);
    if (body.shell) out["shell"] = shell_json(*body.shell, stem);
    return out;
  }

  Json contact_json() const {
    const h6ContactDef& c = scene_.contact;
    const char* known = h6MethodName(c.method);
    if (!known) throw WriteFailed{{"the scene's contact method is out of range"}};
    std::string method = known;
    if (c.method != H6_METHOD_ROBUST) {  // which has these anyway
      if (c.pieces & H6_PIECE_FACING) method += "+facing";
      if (c.pieces & H6_PIECE_DEPTH) method += "+depth";
      if (c.pieces & H6_PIECE_PRODUCT) method += "+product";
    }
    if (c.pieces & H6_PIECE_CLUSTER) method += "+cluster";
    if (c.pieces & H6_PIECE_GEODESIC) method += "+geodesic";
    if (c.pieces & H6_PIECE_HANDLES) method += "+handles";
    if (c.pieces & H6_PIECE_PRINTED) method += "+printed";
    Json out = {{"method", method},
                {"stiffness", c.stiffness},
                {"damping", c.damping},
                {"global_n0", c.global_n0},
                {"epsilon", c.epsilon},
                {"epsilon_normal", c.epsilon_normal},
                {"epsilon_torque", c.epsilon_torque},
                {"torque_length", c.torque_length / scale_},
                {"series_c", c.series_c},
                {"margin_voxels", c.margin_voxels},
                {"cluster_voxels", c.cluster_voxels}};
    if (c.passivity) out["passivity"] = true;
    return out;
  }

  Json coupling_json() const {
    const h6CouplingDef& c = scene_.coupling;
    const char* modes[] = {"dynamic", "static", "direct"};
    if (c.mode < 0 || c.mode > H6_COUPLING_DIRECT)
      throw WriteFailed{{"the scene's coupling mode is out of range"}};
    return {{"mode", modes[c.mode]},
            {"stiffness", c.stiffness},
            {"rotational_stiffness", c.rotational_stiffness},
            {"damping_ratio", c.damping_ratio},
            {"max_depth_voxels", c.max_depth_voxels},
            {"max_force", c.max_force},
            {"max_torque", c.max_torque},
            {"max_step_voxels", c.max_step_voxels}};
  }

  Json hand_json(const SceneHand& hand) {
    Json out = {{"body", hand.body}, {"device", hand.device}};
    if (!hand.path.empty()) {
      const std::string name = unused(file_stem(hand.body) + "_hand", ".csv");
      if (files_) must(write_path(folder_ / name, hand.path, scene_.unit));
      out["path"] = name;
    }
    add_hand_def(hand.def, out);
    const Json safety = safety_json(hand.def.safety);
    if (safety != safety_json(h6DefaultSafetyDef())) out["safety"] = safety;
    if (hand.arm) out["arm"] = arm_json(*hand.arm);
    return out;
  }

  static void add_hand_def(const h6HandDef& def, Json& out) {
    const h6HandFilterDef& f = def.filter;
    out["mode"] = def.mode == H6_ADMITTANCE          ? "admittance"
                  : def.mode == H6_PSEUDO_ADMITTANCE ? "pseudo-admittance"
                                                     : "impedance";
    out["motion_scale"] = f.motion_scale;
    out["rotation_scale"] = f.rotation_scale;
    out["force_scale"] = f.force_scale;
    if (f.relative) out["relative"] = true;
    out["clutch_buttons"] = f.clutch_buttons;
    out["manipulandum_mass"] = def.manipulandum_mass;
    out["driver_stiffness"] = def.driver_stiffness;
    out["driver_damping"] = def.driver_damping;
    out["admittance_damping"] = def.admittance_damping;
    if (def.passivity) out["passivity"] = true;
  }

  Json safety_json(const h6SafetyDef& d) const {
    return {{"max_force", d.max_force},
            {"max_torque", d.max_torque},
            {"max_force_rate", d.max_force_rate},
            {"max_torque_rate", d.max_torque_rate},
            {"max_power", d.max_power},
            {"max_speed", d.max_speed},
            {"derate_speed", d.derate_speed},
            {"cut_speed", d.cut_speed},
            {"soft_start", d.soft_start},
            {"decay_time", d.decay_time},
            {"pose_jump", d.pose_jump / scale_},
            {"freeze_time", d.freeze_time},
            {"dead_man_buttons", d.dead_man_buttons}};
  }

  Json arm_json(const SceneArm& arm) const {
    Json out = {{"delay_frames", arm.delay_frames}};
    for (const ArmNumber& key : arm_numbers())
      out[key.name] = arm.*key.value / (key.length ? scale_ : 1);
    out["velocity"] = arm.exact_velocity ? "exact" : "filtered";
    if (arm.workspace_min.x < arm.workspace_max.x)
      out["workspace"] = {lengths(arm.workspace_min), lengths(arm.workspace_max)};
    return out;
  }

  Json verdict_json() const {
    Json out = Json::object();
    for (const Box& box : scene_.verdict.forbidden)
      out["forbidden"].push_back({{"box", {lengths(box.low), lengths(box.high)}}});
    if (scene_.verdict.target)
      out["target"] = {{"pose", pose_json(*scene_.verdict.target)},
                       {"tolerance", scene_.verdict.tolerance / scale_},
                       {"tolerance_angle", scene_.verdict.tolerance_angle}};
    return out;
  }

  const Scene& scene_;
  fs::path folder_;
  double scale_;  // metres in one unit of the scene
  bool files_ = true;
  std::vector<std::string> used_;
  std::vector<std::pair<const Mesh*, std::string>> meshes_;
  std::vector<std::pair<fs::path, std::string>> copies_;
};

}  // namespace

std::string scene_text(const Scene& scene) { return SceneWriter(scene).write().dump(); }

Outcome export_scene(const Scene& scene, const std::filesystem::path& folder) {
  try {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder, error))
      return Failure{folder.string() + ": cannot be made a folder; " + error.message()};
    const Json json = SceneWriter(scene, folder).write();
    // The scene file last: where it stands, the files it names stand too.
    return write_aside(folder / "scene.json", [&](const fs::path& aside) -> Outcome {
      std::ofstream out(aside);
      out << json.dump(2) << '\n';
      out.close();
      if (!out)
        return Failure{(folder / "scene.json").string() + ": writing failed; is the disk full?"};
      return Done{};
    });
  } catch (const WriteFailed& failed) {
    return failed.failure;
  } catch (const std::exception& e) {
    return Failure{folder.string() + ": the scene cannot be written (" + e.what() + ")"};
  }
}

}  // namespace h6::io
