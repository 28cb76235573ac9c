// SPDX-License-Identifier: Apache-2.0
// scene_command.cpp - hapsix scene list | export NAME DIR: generated scenes as plain files.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

int list_command(const Console& console) {
  nlohmann::ordered_json json{{"scenes", nlohmann::ordered_json::array()}};
  std::size_t width = 0;
  for (const io::SceneName& scene : io::scene_names()) width = std::max(width, scene.name.size());
  for (const io::SceneName& scene : io::scene_names()) {
    json["scenes"].push_back({{"name", scene.name}, {"about", scene.about}});
    if (!console.json)
      std::printf("%-*s  %s\n", static_cast<int>(width), scene.name.c_str(), scene.about.c_str());
  }
  console.result(json);
  return kOk;
}

int export_command(const Console& console, const std::string& name, const std::string& folder) {
  Result<io::Scene> scene = io::make_scene(name);
  if (!scene) return console.fail(scene.error(), kUsage);
  if (Outcome done = io::export_scene(*scene, folder); !done) return console.fail(done.error());
  const std::string file = (std::filesystem::path(folder) / "scene.json").string();
  console.result({{"scene", name}, {"file", file}});
  if (!console.json) std::printf("%s\n", printable(file).c_str());
  return kOk;
}

}  // namespace

void add_scene(CLI::App& app, Program& program) {
  CLI::App* scene =
      app.add_subcommand("scene", "Generated scenes: their list, or one as plain files");
  scene->require_subcommand(1);
  CLI::App* list = scene->add_subcommand("list", "What there is");
  list->callback(
      [&program] { program.work = [&program] { return list_command(program.console); }; });
  CLI::App* out =
      scene->add_subcommand("export", "A scene as plain files: scene.json, STL, PLY, CSV path");
  auto name = std::make_shared<std::string>(), folder = std::make_shared<std::string>();
  out->add_option("NAME", *name, "From 'hapsix scene list'")->required()->option_text("NAME");
  out->add_option("DIR", *folder, "A folder; made when it is not there")
      ->required()
      ->option_text("FOLDER");
  out->callback([&program, name, folder] {
    program.work = [&program, name, folder] {
      return export_command(program.console, *name, *folder);
    };
  });
}

}  // namespace h6::cli
