// SPDX-License-Identifier: Apache-2.0
// experiments_command.cpp - hapsix experiments [NAME...]: runs the paper's experiments with every
// method and prints tables.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/experiments/studies.h"
#include "io/file/write_aside.h"

namespace h6::cli {
namespace {

struct Options {
  std::vector<std::string> names;
  std::string folder, methods;
};

struct Chosen {
  std::vector<const TableScene*> scenes;
  std::vector<const StudyKind*> studies;
};

// Finds the scenes and studies of these names. Without names it returns all but the long studies.
Result<Chosen> choose(const std::vector<std::string>& names) {
  Chosen out;
  std::vector<std::string> known;
  for (const TableScene& s : table_scenes()) known.push_back(s.name);
  for (const StudyKind& s : studies()) known.push_back(s.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      return Failure{no_such("experiment", name, known)};
  const auto wanted = [&](const char* name) {
    return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const TableScene& s : table_scenes())
    if (wanted(s.name)) out.scenes.push_back(&s);
  for (const StudyKind& s : studies())
    if (wanted(s.name) && !(names.empty() && s.long_run)) out.studies.push_back(&s);
  return out;
}

Outcome make_folder(const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return Failure{"the folder " + folder + " cannot be made (" + failed.message() +
                   "): choose another with -o"};
  return Done{};
}

int experiments_command(const Console& console, const Options& o) {
  const auto start = std::chrono::steady_clock::now();
  Result<Chosen> chosen = choose(o.names);
  if (!chosen) return console.fail(chosen.error(), kUsage);
  Result<std::vector<MethodColumn>> columns_of = columns_named(o.methods);
  if (!columns_of) return console.fail(columns_of.error(), kUsage);
  if (!o.folder.empty())
    if (Outcome made = make_folder(o.folder); !made) return console.fail(made.error());

  const std::vector<MethodColumn>& columns = *columns_of;
  const std::vector<SceneRow> rows = run_scene_table(chosen->scenes, columns, o.folder, console);
  if (!console.json && !rows.empty() && !interrupted.load()) {
    std::printf("%s\n", plain(scene_table(rows, columns)).c_str());
    std::fflush(stdout);
  }
  std::vector<Study> done;
  for (const StudyKind* kind : chosen->studies) {
    if (interrupted.load()) break;
    done.push_back(kind->run(columns, console));
    done.back().name = kind->name;
    if (console.json || interrupted.load()) continue;
    std::printf("%s\n%s\n", done.back().title.c_str(), plain(done.back().table).c_str());
    std::fflush(stdout);
  }
  if (interrupted.load()) return console.fail("interrupted");

  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  nlohmann::ordered_json json{{"scenes", nlohmann::ordered_json::object()},
                              {"studies", nlohmann::ordered_json::object()},
                              {"seconds", seconds}};
  std::string failed;
  for (const SceneRow& row : rows) {
    json["scenes"][row.scene->name] = to_json(row, columns);
    for (const RunFigures& run : row.runs)
      if (!run.error.empty() && failed.empty())
        failed = std::string(row.scene->name) + ": " + run.error;
  }
  for (const Study& study : done) json["studies"][study.name] = study.json;
  if (!o.folder.empty()) {
    const std::string file = (std::filesystem::path(o.folder) / "EXPERIMENTS.md").string();
    const std::string text = markdown_report(rows, columns, done, seconds);
    const Outcome written = io::write_text_aside(file, text);
    if (!written) return console.fail(written.error());
    for (const Study& study : done) {
      if (study.picture.empty()) continue;
      const auto picture = std::filesystem::path(o.folder) / (study.name + ".svg");
      if (const Outcome kept = io::write_text_aside(picture, study.picture); !kept)
        return console.fail(kept.error());
    }
    json["report"] = file;
    if (!console.json) std::printf("report: %s\n", file.c_str());
  }
  if (!failed.empty()) json["error"] = failed;
  console.result(json);
  if (failed.empty()) return kOk;
  console.log("hapsix: " + failed);
  return kFailed;
}

}  // namespace

void add_experiments(CLI::App& app, Program& program) {
  CLI::App* experiments = app.add_subcommand(
      "experiments", "The paper's experiments as tables: every scene, every weight method");
  auto o = std::make_shared<Options>();
  std::string list = "Scenes and studies, default all:";
  for (const TableScene& s : table_scenes()) list += std::string(" ") + s.name;
  for (const StudyKind& s : studies())
    list += std::string(" ") + s.name + (s.long_run ? " (only by name)" : "");
  experiments->add_option("NAME", o->names, list)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->option_text("NAME...");
  experiments->add_option("--methods", o->methods, "Columns, default every method")
      ->option_text("A,B,...");
  experiments
      ->add_option("-o,--output", o->folder,
                   "Folder for a report, EXPERIMENTS.md, and a recording of every run")
      ->option_text("FOLDER");
  experiments->callback([&program, o] {
    program.work = [&program, o] { return experiments_command(program.console, *o); };
  });
}

}  // namespace h6::cli
