// SPDX-License-Identifier: Apache-2.0
// write.cpp - writes a scene as plain files: scene.json, STL meshes, PLY shells, CSV paths.
//
// It writes defaults too, so that the file holds everything that the run depends on.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/deform/deformable_file.h"
#include "io/file/write_aside.h"
#include "io/scene/cache.h"
#include "io/scene/scene_file.h"
#include "io/scene/scene_settings.h"
#include "io/scene/setting_json.h"
#include "io/shell/shell_file.h"

namespace h6::io {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace fs = std::filesystem;

// Turns a body's name into a file name that every system accepts.
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
  // Makes the text only and writes no file.
  explicit SceneWriter(const Scene& scene)
      : scene_(scene), scale_(metres(scene.unit)), files_(false) {}

  OrderedJson write() {
    OrderedJson out = {{"hapsix", 1}};
    write_settings(scene_settings(), &scene_, scale_, out, [&](const Setting& row, OrderedJson& o) {
      const std::string key = row.name;
      if (key == "bodies") {
        o[key] = OrderedJson::array();
        for (const SceneBody& body : scene_.bodies) o[key].push_back(body_json(body));
      } else if (key == "hands") {
        o[key] = OrderedJson::array();
        for (const SceneHand& hand : scene_.hands) o[key].push_back(hand_json(hand));
      } else if (key == "verdict") {
        const OrderedJson verdict = verdict_json();
        if (!verdict.empty()) o[key] = verdict;
      }
    });
    return out;
  }

 private:
  // A file name that no other file of this scene has.
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

  // Adds "mesh", and its unit if that is not the scene's.
  template <class Source>
  void mesh_json(const Source& source, const std::string& stem, OrderedJson& out) {
    if (source.mesh_data) {
      out["mesh"] = write_mesh(*source.mesh_data, stem);
    } else {
      out["mesh"] = copy_file(source.mesh);
      if (source.unit && *source.unit != scene_.unit) out["units"] = unit_name(*source.unit);
    }
  }

  OrderedJson field_json(const FieldSource& field, const std::string& stem) {
    OrderedJson out;
    if (!field.file.empty()) return {{"file", copy_file(field.file)}};
    mesh_json(field, stem, out);
    write_settings(field_source_settings(), &field, scale_, out);
    return out;
  }

  std::string bends_json(const BendSource& bends, const std::string& stem) {
    if (!bends.solid) return copy_file(bends.file);
    const std::string name = unused(stem + "_bends", ".h5");
    if (!files_) return name;
    const Result<ReducedModel> model = cached_bend(*bends.solid, bends.reduce, nullptr);
    if (!model) throw WriteFailed{model.failure()};
    must(write_deformable(folder_ / name, *model));
    return name;
  }

  OrderedJson shell_json(const ShellSource& shell, const std::string& stem) {
    OrderedJson out = rigid_shell_json(shell, stem);
    if (shell.bends) out["bends"] = bends_json(*shell.bends, stem);
    return out;
  }

  OrderedJson rigid_shell_json(const ShellSource& shell, const std::string& stem) {
    OrderedJson out;
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
    write_settings(shell_source_settings(), &shell, scale_, out);
    return out;
  }

  OrderedJson body_json(const SceneBody& body) {
    OrderedJson out;
    write_settings(scene_body_settings(), &body, scale_, out);
    if (body.fixed) out.erase("mass");  // a fixed body needs no mass
    const std::string stem = file_stem(body.name);
    if (body.field) out["field"] = field_json(*body.field, stem);
    if (body.shell) out["shell"] = shell_json(*body.shell, stem);
    return out;
  }

  OrderedJson hand_json(const SceneHand& hand) {
    OrderedJson out;
    write_settings(scene_hand_settings(), &hand, scale_, out,
                   [&](const Setting& row, OrderedJson& o) {
                     if (row.name != std::string("path") || hand.path.empty()) return;
                     const std::string name = unused(file_stem(hand.body) + "_hand", ".csv");
                     if (files_) must(write_path(folder_ / name, hand.path, scene_.unit));
                     o[row.name] = name;
                   });
    return out;
  }

  OrderedJson verdict_json() const {
    OrderedJson out = OrderedJson::object();
    for (const Box& box : scene_.verdict.forbidden)
      write_settings(forbidden_settings(), &box, scale_, out["forbidden"].emplace_back());
    if (scene_.verdict.target)
      write_settings(target_settings(), &scene_.verdict, scale_, out["target"]);
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
    const OrderedJson json = SceneWriter(scene, folder).write();
    // The scene file is written last, so that the files it names exist when it does.
    return write_text_aside(folder / "scene.json", json.dump(2) + '\n');
  } catch (const WriteFailed& failed) {
    return failed.failure;
  } catch (const std::exception& e) {
    return Failure{folder.string() + ": the scene cannot be written (" + e.what() + ")"};
  }
}

}  // namespace h6::io
