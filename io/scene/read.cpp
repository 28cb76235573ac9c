// SPDX-License-Identifier: Apache-2.0
// read.cpp - reads scene files: text -> checked JSON -> Scene.
//
//   check_json_text   checks that the text is JSON and not too large      (io/file/json.cpp)
//   check_scene_json  checks every key, its kind and its range            (check.cpp)
//   read_settings     copies values into the members of their rows        (setting_json.cpp)
//   SceneReader       resolves names of bodies and files, and reads rows without a member
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/file/json.h"
#include "io/scene/check.h"
#include "io/scene/scene_file.h"
#include "io/scene/scene_settings.h"
#include "io/scene/setting_json.h"

namespace h6::io {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;

// Makes a Scene from JSON. check_scene_json must have accepted it, so kinds and ranges are right.
class SceneReader {
 public:
  SceneReader(const fs::path& file, bool outside)
      : folder_(file.parent_path()), scene_file_(file), outside_(outside) {}
  // Reads the scene of a recording, whose files need not exist.
  SceneReader() : recorded_(true) {}

  Scene read(const Json& o) {
    if (o.contains("units")) scene_.unit = *unit_from_name(o["units"].get<std::string>());
    scene_.unit_is_stated = recorded_ || o.contains("units");
    scale_ = metres(scene_.unit);
    read_settings(o, scene_settings(), &scene_, scale_);
    for (std::size_t i = 0; i < o["bodies"].size(); ++i)
      read_body(o["bodies"][i], "bodies[" + std::to_string(i) + "]");
    if (o.contains("hands"))
      for (std::size_t i = 0; i < o["hands"].size(); ++i)
        read_hand(o["hands"][i], "hands[" + std::to_string(i) + "]");
    if (o.contains("verdict")) read_verdict(o["verdict"]);
    return std::move(scene_);
  }

 private:
  fs::path existing(const Json& o, const char* key, const std::string& at) const {
    const std::string name = o[key].get<std::string>();
    const fs::path file = folder_ / fs::path(name);  // an absolute name replaces the folder
    if (!recorded_ && !outside_ && !lies_below(file, scene_file_))
      throw Complaint{inside(at, key), "\"" + shown(name) +
                                           "\" lies outside the folder of the scene file: move it "
                                           "there, or give --allow-outside if you trust the scene"};
    std::error_code error;
    if (!recorded_ && !fs::is_regular_file(file, error))
      throw Complaint{
          inside(at, key),
          "there is no file \"" + shown(name) + "\"" +
              (fs::path(name).is_absolute() ? std::string{} : " beside the scene file")};
    return file;
  }

  // Reads `mesh` with its bake options, or `file`.
  template <class Source>
  Source read_source(const Json& o, const SettingTable& rows, const std::string& at) const {
    Source out;
    if (o.contains("mesh") == o.contains("file"))
      throw Complaint{at, "needs either \"mesh\" (to bake) or \"file\" (baked), one of them"};
    if (o.contains("mesh")) {
      out.mesh = existing(o, "mesh", at);
      if (o.contains("units")) out.unit = *unit_from_name(o["units"].get<std::string>());
      read_settings(o, rows, &out, scale_);
      return out;
    }
    out.file = existing(o, "file", at);
    for (const auto& [key, value] : o.items())
      if (key != "file" && key != "bends")
        throw Complaint{inside(at, key),
                        "has no meaning beside \"file\": that is baked, in metres"};
    return out;
  }

  void read_bends(const Json& o, const std::string& at, SceneBody& body) const {
    body.shell->bends = BendSource{existing(o, "bends", at), {}, {}};
    if (!body.fixed)
      throw Complaint{inside(at, "bends"),
                      "a body that bends stands still: give \"" + shown(body.name) +
                          "\" \"fixed\": true"};
    if (body.field)
      throw Complaint{inside(at, "bends"),
                      "a body that bends touches by its shell; others cannot touch its \"field\", "
                      "so leave that out"};
  }

  void read_body(const Json& o, const std::string& at) {
    SceneBody body;
    read_settings(o, scene_body_settings(), &body, scale_);
    if (find_body(body.name))
      throw Complaint{inside(at, "name"), "there is another body \"" + shown(body.name) + "\""};
    if (o.contains("field"))
      body.field =
          read_source<FieldSource>(o["field"], field_source_settings(), inside(at, "field"));
    if (o.contains("shell")) {
      body.shell =
          read_source<ShellSource>(o["shell"], shell_source_settings(), inside(at, "shell"));
      if (o["shell"].contains("bends")) read_bends(o["shell"], inside(at, "shell"), body);
    }
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

  void read_hand(const Json& o, const std::string& at) {
    SceneHand hand;
    read_settings(o, scene_hand_settings(), &hand, scale_);
    const SceneBody* body = find_body(hand.body);
    if (!body) throw Complaint{inside(at, "body"), "there is no body \"" + shown(hand.body) + "\""};
    if (body->fixed)
      throw Complaint{inside(at, "body"),
                      "\"" + shown(hand.body) + "\" is fixed; a hand needs a body that moves"};
    for (const SceneHand& other : scene_.hands)
      if (other.body == hand.body)
        throw Complaint{inside(at, "body"),
                        "another hand holds \"" + shown(hand.body) + "\" already"};
    if (recorded_) {
      if (o.contains("path")) hand.path_file = o["path"].get<std::string>();
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
    SceneVerdict& verdict = scene_.verdict;
    if (o.contains("forbidden"))
      for (const Json& entry : o["forbidden"])
        read_settings(entry, forbidden_settings(), &verdict.forbidden.emplace_back(), scale_);
    if (!verdict.forbidden.empty() && scene_.hands.empty())
      throw Complaint{"verdict.forbidden", "watches the first hand's body, but there is no hand"};
    if (!o.contains("target")) return;
    if (scene_.hands.empty())
      throw Complaint{"verdict.target", "is for the first hand's body, but there is no hand"};
    verdict.target = h6Pose{{0, 0, 0}, {1, 0, 0, 0}};
    read_settings(o["target"], target_settings(), &verdict, scale_);
  }

  fs::path folder_, scene_file_;
  bool recorded_ = false, outside_ = false;
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

// Reads `text` as a scene. Error sentences call it `name`.
Result<Scene> parse(const std::string& text, const std::string& name, SceneReader reader) {
  try {
    if (const Outcome json = check_json_text(text, name); !json) return json.failure();
    const Json root = Json::parse(text);
    check_scene_json(root);
    return reader.read(root);
  } catch (const Complaint& complaint) {
    return Failure{name + ": " + (complaint.where.empty() ? "" : complaint.where + ": ") +
                   complaint.what};
  } catch (const std::exception& e) {
    return Failure{name + ": cannot be read as a scene (" + e.what() + ")"};
  }
}

}  // namespace

bool lies_below(const fs::path& file, const fs::path& scene) {
  std::error_code failed;
  const fs::path folder = fs::canonical(fs::absolute(scene, failed).parent_path(), failed);
  if (failed) return false;
  const fs::path place = fs::weakly_canonical(fs::absolute(file, failed), failed);
  if (failed) return false;
  return std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first ==
         folder.end();
}

Result<Scene> read_scene(const fs::path& file, bool outside) {
  const Result<std::string> text = read_text(file);
  if (!text) return text.failure();
  Result<Scene> scene = parse(*text, file.string(), SceneReader(file, outside));
  if (!scene) return scene;
  if (scene->name.empty()) scene->name = file.stem().string();
  scene->file = file;
  return scene;
}

Result<Scene> read_scene_text(const std::string& text, const std::string& name) {
  return parse(text, name, SceneReader());
}

}  // namespace h6::io
