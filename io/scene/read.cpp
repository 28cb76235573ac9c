// SPDX-License-Identifier: Apache-2.0
// read.cpp - scene files: text -> checked JSON -> Scene.
//
//   check_json_text   is it JSON, and of a sane size                 (json.cpp)
//   check             every key known, of its kind, in its range     (check.cpp)
//   SceneReader       numbers to metres, names to bodies, files to paths; what the table cannot say
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/file/json.h"
#include "io/scene/check.h"
#include "io/scene/keys.h"
#include "io/scene/scene_file.h"

namespace h6::io {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;

// ---- into a Scene ------------------------------------------------------------------------------
// Only checked JSON comes here: kinds and ranges hold.

double number(const Json& o, const char* key, double fallback) {
  return o.contains(key) ? o[key].get<double>() : fallback;
}

std::string text(const Json& o, const char* key, const std::string& fallback) {
  return o.contains(key) ? o[key].get<std::string>() : fallback;
}

h6Vec3 vec3(const Json& v, double scale) {
  return {v[0].get<double>() * scale, v[1].get<double>() * scale, v[2].get<double>() * scale};
}

h6Pose pose(const Json& o, double scale) {
  h6Pose out = {{0, 0, 0}, {1, 0, 0, 0}};
  if (o.contains("p")) out.p = vec3(o["p"], scale);
  if (o.contains("q")) {
    double q[4], norm2 = 0;
    for (int i = 0; i < 4; ++i) q[i] = o["q"][i].get<double>(), norm2 += q[i] * q[i];
    const double s = 1 / std::sqrt(norm2);
    out.q = {q[0] * s, q[1] * s, q[2] * s, q[3] * s};
  }
  return out;
}

class SceneReader {
 public:
  explicit SceneReader(const fs::path& file) : folder_(file.parent_path()) {}
  // Of a recording: files are only named.
  SceneReader() : recorded_(true) {}

  Scene read(const Json& o) {
    const std::string units = text(o, "units", "m");
    scene_.unit = *unit_from_name(units);
    scale_ = metres(scene_.unit);
    scene_.name = text(o, "name", "");
    scene_.about = text(o, "about", "");
    for (std::size_t i = 0; i < o["bodies"].size(); ++i)
      read_body(o["bodies"][i], "bodies[" + std::to_string(i) + "]");
    read_contact(o.value("contact", Json::object()));
    read_coupling(o.value("coupling", Json::object()));
    scene_.integrator = text(o, "integrator", "implicit") == "explicit" ? H6_EXPLICIT : H6_IMPLICIT;
    scene_.gradient = text(o, "gradient", "symmetric") == "exact" ? H6_EXACT : H6_SYMMETRIC;
    scene_.rate = number(o, "rate", scene_.rate);
    scene_.duration = number(o, "duration", 0);
    if (o.contains("hands"))
      for (std::size_t i = 0; i < o["hands"].size(); ++i)
        read_hand(o["hands"][i], "hands[" + std::to_string(i) + "]");
    scene_.net_stiffness = o.value("net_stiffness", false);
    if (o.contains("verdict")) read_verdict(o["verdict"]);
    return std::move(scene_);
  }

 private:
  fs::path existing(const Json& o, const char* key, const std::string& at) const {
    const std::string name = o[key].get<std::string>();
    const fs::path file = folder_ / fs::path(name);  // an absolute name replaces the folder
    std::error_code error;
    if (!recorded_ && !fs::is_regular_file(file, error))
      throw Complaint{
          inside(at, key),
          "there is no file \"" + shown(name) + "\"" +
              (fs::path(name).is_absolute() ? std::string{} : " beside the scene file")};
    return file;
  }

  // `mesh` or `file`; true: a mesh, so that bake options count.
  template <class Source>
  bool read_source(const Json& o, const std::string& at, Source& out) const {
    if (o.contains("mesh") == o.contains("file"))
      throw Complaint{at, "needs either \"mesh\" (to bake) or \"file\" (baked), one of them"};
    if (o.contains("mesh")) {
      out.mesh = existing(o, "mesh", at);
      if (o.contains("units")) out.unit = *unit_from_name(o["units"].get<std::string>());
      return true;
    }
    out.file = existing(o, "file", at);
    for (const auto& [key, value] : o.items())
      if (key != "file")
        throw Complaint{inside(at, key),
                        "has no meaning beside \"file\": that is baked, in metres"};
    return false;
  }

  static void not_both(const Json& o, const char* a, const char* b, const std::string& at) {
    if (o.contains(a) && o.contains(b))
      throw Complaint{inside(at, b), std::string("stands beside \"") + a + "\"; give one of them"};
  }

  FieldSource read_field_source(const Json& o, const std::string& at) const {
    FieldSource out;
    if (!read_source(o, at, out)) return out;
    not_both(o, "voxels", "voxel_size", at);
    out.bake.voxels = static_cast<int>(number(o, "voxels", out.bake.voxels));
    out.bake.voxel_size = number(o, "voxel_size", 0) * scale_;
    if (o.contains("offset")) out.bake.offset = number(o, "offset", 0) * scale_;
    out.bake.sign = text(o, "sign", "auto") == "flood" ? SignMode::flood : SignMode::automatic;
    out.bake.cavities =
        text(o, "cavities", "solid") == "hollow" ? Cavities::hollow : Cavities::solid;
    out.bake.seal = number(o, "seal", 0) * scale_;
    out.bake.band_voxels = number(o, "band_voxels", out.bake.band_voxels);
    out.bake.padding_voxels =
        static_cast<int>(number(o, "padding_voxels", out.bake.padding_voxels));
    return out;
  }

  ShellSource read_shell_source(const Json& o, const std::string& at) const {
    ShellSource out;
    if (!read_source(o, at, out)) return out;
    not_both(o, "points", "spacing", at);
    out.bake.points =
        static_cast<std::size_t>(number(o, "points", static_cast<double>(out.bake.points)));
    out.bake.spacing = number(o, "spacing", 0) * scale_;
    out.bake.levels = static_cast<int>(number(o, "levels", out.bake.levels));
    out.bake.seed =
        static_cast<std::uint64_t>(number(o, "seed", static_cast<double>(out.bake.seed)));
    not_both(o, "voxels", "voxel_size", at);
    out.bake.surface = *surface_from_name(text(o, "surface", "auto"));  // the schema has checked
    out.bake.normals = *normals_from_name(text(o, "normals", "auto"));
    out.bake.field.voxels = static_cast<int>(number(o, "voxels", out.bake.field.voxels));
    out.bake.field.voxel_size = number(o, "voxel_size", 0) * scale_;
    if (o.contains("offset")) out.bake.field.offset = number(o, "offset", 0) * scale_;
    out.bake.field.seal = number(o, "seal", 0) * scale_;
    return out;
  }

  void read_body(const Json& o, const std::string& at) {
    SceneBody body;
    body.name = o["name"].get<std::string>();
    if (find_body(body.name))
      throw Complaint{inside(at, "name"), "there is another body \"" + shown(body.name) + "\""};
    body.fixed = o.value("fixed", false);
    body.translation_only = o.value("translation_only", false);
    body.mass = number(o, "mass", body.mass);
    if (o.contains("com")) body.com = vec3(o["com"], scale_);
    if (o.contains("inertia")) body.inertia = o["inertia"].get<std::array<double, 6>>();
    body.pose = pose(o.value("pose", Json::object()), scale_);
    if (o.contains("field")) body.field = read_field_source(o["field"], inside(at, "field"));
    if (o.contains("shell")) body.shell = read_shell_source(o["shell"], inside(at, "shell"));
    if (!body.field && !body.shell)
      throw Complaint{at,
                      "needs a \"shell\" (it touches others), a \"field\" (others touch it) or "
                      "both"};
    scene_.bodies.push_back(std::move(body));
  }

  const SceneBody* find_body(const std::string& name) const {
    for (const SceneBody& body : scene_.bodies)
      if (body.name == name) return &body;
    return nullptr;
  }

  void read_contact(const Json& o) {
    h6ContactDef& c = scene_.contact = h6DefaultContactDef();
    if (o.contains("method"))
      h6MethodFromName(o["method"].get_ref<const std::string&>().c_str(), &c.method, &c.pieces);
    c.stiffness = number(o, "stiffness", c.stiffness);
    c.damping = number(o, "damping", c.damping);
    c.global_n0 = number(o, "global_n0", c.global_n0);
    c.epsilon = number(o, "epsilon", c.epsilon);
    c.epsilon_normal = number(o, "epsilon_normal", c.epsilon_normal);
    c.epsilon_torque = number(o, "epsilon_torque", c.epsilon_torque);
    if (o.contains("torque_length")) c.torque_length = number(o, "torque_length", 0) * scale_;
    c.series_c = number(o, "series_c", c.series_c);
    c.margin_voxels = number(o, "margin_voxels", c.margin_voxels);
    c.cluster_voxels = number(o, "cluster_voxels", c.cluster_voxels);
    c.passivity = o.value("passivity", false);
  }

  void read_coupling(const Json& o) {
    h6CouplingDef& c = scene_.coupling = h6DefaultCouplingDef();
    const std::string mode = text(o, "mode", "dynamic");
    c.mode = mode == "static"   ? H6_COUPLING_STATIC
             : mode == "direct" ? H6_COUPLING_DIRECT
                                : H6_COUPLING_DYNAMIC;
    c.stiffness = number(o, "stiffness", c.stiffness);
    c.rotational_stiffness = number(o, "rotational_stiffness", c.rotational_stiffness);
    c.damping_ratio = number(o, "damping_ratio", c.damping_ratio);
    c.max_depth_voxels = number(o, "max_depth_voxels", c.max_depth_voxels);
    c.max_force = number(o, "max_force", c.max_force);
    c.max_torque = number(o, "max_torque", c.max_torque);
    c.max_step_voxels = number(o, "max_step_voxels", c.max_step_voxels);
  }

  void read_hand_def(const Json& o, h6HandDef& def) const {
    const std::string mode = text(o, "mode", "impedance");
    def.mode = mode == "admittance"          ? H6_ADMITTANCE
               : mode == "pseudo-admittance" ? H6_PSEUDO_ADMITTANCE
                                             : H6_IMPEDANCE;
    h6HandFilterDef& f = def.filter;
    f.motion_scale = number(o, "motion_scale", f.motion_scale);
    f.rotation_scale = number(o, "rotation_scale", f.rotation_scale);
    f.force_scale = number(o, "force_scale", f.force_scale);
    f.relative = o.value("relative", false);
    f.clutch_buttons = static_cast<std::uint32_t>(number(o, "clutch_buttons", 0));
    def.manipulandum_mass = number(o, "manipulandum_mass", def.manipulandum_mass);
    def.driver_stiffness = number(o, "driver_stiffness", def.driver_stiffness);
    def.driver_damping = number(o, "driver_damping", def.driver_damping);
    def.admittance_damping = number(o, "admittance_damping", def.admittance_damping);
    def.passivity = o.value("passivity", false);
  }

  void read_safety(const Json& o, h6SafetyDef& d) const {
    d.max_force = number(o, "max_force", d.max_force);
    d.max_torque = number(o, "max_torque", d.max_torque);
    d.max_force_rate = number(o, "max_force_rate", d.max_force_rate);
    d.max_torque_rate = number(o, "max_torque_rate", d.max_torque_rate);
    d.max_power = number(o, "max_power", d.max_power);
    d.max_speed = number(o, "max_speed", d.max_speed);
    d.derate_speed = number(o, "derate_speed", d.derate_speed);
    d.cut_speed = number(o, "cut_speed", d.cut_speed);
    d.soft_start = number(o, "soft_start", d.soft_start);
    d.decay_time = number(o, "decay_time", d.decay_time);
    if (o.contains("pose_jump")) d.pose_jump = number(o, "pose_jump", 0) * scale_;
    d.freeze_time = number(o, "freeze_time", d.freeze_time);
    d.dead_man_buttons = static_cast<std::uint32_t>(number(o, "dead_man_buttons", 0));
  }

  SceneArm read_arm(const Json& o) const {
    SceneArm arm;
    arm.delay_frames = static_cast<int>(number(o, "delay_frames", arm.delay_frames));
    for (const ArmNumber& key : arm_numbers()) {
      const double scale = key.length ? scale_ : 1;
      arm.*key.value = number(o, key.name, arm.*key.value / scale) * scale;
    }
    arm.exact_velocity = text(o, "velocity", "filtered") == "exact";
    if (o.contains("workspace")) {
      arm.workspace_min = vec3(o["workspace"][0], scale_);
      arm.workspace_max = vec3(o["workspace"][1], scale_);
    }
    return arm;
  }

  void read_hand(const Json& o, const std::string& at) {
    SceneHand hand;
    hand.body = o["body"].get<std::string>();
    const SceneBody* body = find_body(hand.body);
    if (!body) throw Complaint{inside(at, "body"), "there is no body \"" + shown(hand.body) + "\""};
    if (body->fixed)
      throw Complaint{inside(at, "body"),
                      "\"" + shown(hand.body) + "\" is fixed; a hand needs a body that moves"};
    for (const SceneHand& other : scene_.hands)
      if (other.body == hand.body)
        throw Complaint{inside(at, "body"),
                        "another hand holds \"" + shown(hand.body) + "\" already"};
    hand.device = text(o, "device", hand.device);
    read_hand_def(o, hand.def);
    if (o.contains("safety")) read_safety(o["safety"], hand.def.safety);
    if (o.contains("arm")) hand.arm = read_arm(o["arm"]);
    if (recorded_) {
      hand.path_file = text(o, "path", "");
    } else if (o.contains("path")) {
      hand.path_file = existing(o, "path", at);
      Result<Path> path = read_path(hand.path_file, scene_.unit);
      if (!path) throw Complaint{inside(at, "path"), path.error()};
      hand.path = std::move(*path);
    } else if (hand.device == "path") {
      throw Complaint{inside(at, "path"), "is missing: the device \"path\" follows a CSV file"};
    }
    scene_.hands.push_back(std::move(hand));
  }

  void read_verdict(const Json& o) {
    if (o.contains("forbidden"))
      for (const Json& entry : o["forbidden"])
        scene_.verdict.forbidden.push_back(
            {vec3(entry["box"][0], scale_), vec3(entry["box"][1], scale_)});
    if (!scene_.verdict.forbidden.empty() && scene_.hands.empty())
      throw Complaint{"verdict.forbidden", "watches the first hand's body, but there is no hand"};
    if (!o.contains("target")) return;
    if (scene_.hands.empty())
      throw Complaint{"verdict.target", "is for the first hand's body, but there is no hand"};
    scene_.verdict.target = pose(o["target"]["pose"], scale_);
    scene_.verdict.tolerance = number(o["target"], "tolerance", 0) * scale_;
    scene_.verdict.tolerance_angle = number(o["target"], "tolerance_angle", 0);
  }

  fs::path folder_;
  bool recorded_ = false;
  Scene scene_;
  double scale_ = 1;  // metres in one unit of the scene
};

Result<std::string> read_text(const fs::path& file) {
  const std::string name = file.string();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return Failure{name + ": no such file"};
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size > kMostBytes)
    return Failure{name +
                   ": larger than 64 MiB; a scene file names its meshes, it does not hold them"};
  std::ifstream in(file, std::ios::binary);
  if (!in) return Failure{name + ": cannot be opened; check its permissions"};
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace

Result<Scene> read_scene(const fs::path& file) {
  const std::string name = file.string();
  try {
    const Result<std::string> text = read_text(file);
    if (!text) return text.failure();
    if (const Outcome json = check_json_text(*text, name); !json) return json.failure();
    const Json root = Json::parse(*text);
    check_scene_json(root);
    Scene scene = SceneReader(file).read(root);
    if (scene.name.empty()) scene.name = file.stem().string();
    scene.file = file;
    return scene;
  } catch (const Complaint& complaint) {
    return Failure{name + ": " + (complaint.where.empty() ? "" : complaint.where + ": ") +
                   complaint.what};
  } catch (const std::exception& e) {
    return Failure{name + ": cannot be read as a scene (" + e.what() + ")"};
  }
}

Result<Scene> read_scene_text(const std::string& text, const std::string& name) {
  try {
    if (const Outcome json = check_json_text(text, name); !json) return json.failure();
    const Json root = Json::parse(text);
    check_scene_json(root);
    return SceneReader().read(root);
  } catch (const Complaint& complaint) {
    return Failure{name + ": " + (complaint.where.empty() ? "" : complaint.where + ": ") +
                   complaint.what};
  } catch (const std::exception& e) {
    return Failure{name + ": cannot be read as a scene (" + e.what() + ")"};
  }
}

}  // namespace h6::io
