// SPDX-License-Identifier: Apache-2.0
// study.cpp - study files: what varies in a scene of two bodies, and what is drawn at random.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"
#include "io/study/plan.h"
#include "tests/fuzz/targets.h"

namespace h6::fuzz {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostRuns = 1000000;
constexpr double kMostChecked = 100;  // a study of more values costs time and shows nothing new

// Its meshes must exist, and nobody reads them here.
constexpr const char* kScene = R"({"hapsix": 1, "units": "mm", "bodies": [
  {"name": "block", "fixed": true, "field": {"mesh": "scene.json", "voxels": 32}},
  {"name": "peg", "mass": 0.1, "shell": {"mesh": "scene.json", "points": 200},
   "pose": {"p": [0, 0, 30], "q": [1, 0, 0, 0]}}],
  "hands": [{"body": "peg", "device": "arm"}]})";

// A study's folder, in which each generated scene was exported before. Beside the study lies the
// scene `s`, with the file that it names.
const fs::path& folder() {
  static const fs::path made = [] {
    const fs::path beside = fs::path(as_file({}, "beside")).parent_path(), at = beside / "study";
    std::ofstream(beside / "s") << kScene, std::ofstream(beside / "scene.json") << kScene;
    for (const io::SceneName& scene : io::scene_names()) {
      const fs::path one = at / "scenes" / scene.name;
      fs::create_directories(one);
      const std::string name = "\"name\": \"" + scene.name + "\", ";
      std::ofstream(one / "scene.json") << std::string(kScene).insert(1, name);
    }
    return at;
  }();
  return made;
}

// Whether the program would read the scene once for each of very many values.
bool takes_long(const Json& study) {
  if (!study.is_object() || !study.contains("vary") || !study["vary"].is_object()) return false;
  double values = 0, runs = 1;
  for (const auto& [key, given] : study["vary"].items()) {
    double count = given.is_array() ? static_cast<double>(given.size()) : 2;
    if (given.is_object() && given.contains("count") && given["count"].is_number())
      count = given["count"].get<double>();
    values += count, runs *= count;
  }
  if (study.contains("repeats") && study["repeats"].is_number())
    runs *= study["repeats"].get<double>();
  return values > kMostChecked && runs <= kMostRuns;
}

void check_draws(const Json& study, const std::vector<std::string>& values) {
  if (!study.contains("draw")) return;
  std::size_t at = values.size() - study["draw"].size();
  for (const auto& [key, range] : study["draw"].items()) {
    const double low = range["low"].get<double>(), high = range["high"].get<double>();
    const double drawn = std::strtod(values[at++].c_str(), nullptr);
    const double room = 1e-9 * (std::abs(low) + std::abs(high));
    promise(drawn >= std::min(low, high) - room && drawn <= std::max(low, high) + room,
            "a draw lies between low and high");
  }
}

void check_files(const io::Scene& scene, const fs::path& of) {
  const auto below = [&](const fs::path& file) {
    promise(file.empty() || io::lies_below(file, of), "a study reads no strange file");
  };
  for (const io::SceneBody& body : scene.bodies) {
    if (body.field) below(body.field->mesh), below(body.field->file);
    if (body.shell) below(body.shell->mesh), below(body.shell->file);
    if (body.shell && body.shell->bends) below(body.shell->bends->file);
  }
}

void check_run(const study::Plan& plan, const Json& study, std::size_t run) {
  const std::vector<std::string> values = plan.values(run);
  promise(values.size() == plan.keys().size(), "a run has a value for each key");
  promise(plan.repeat(run) < plan.runs(), "a run is one of the repeats");
  check_draws(study, values);
  const std::vector<std::string> first = plan.values(plan.repeat(run));
  const std::size_t draws = study.contains("draw") ? study["draw"].size() : 0;
  promise(std::equal(values.end() - static_cast<long>(draws), values.end(),
                     first.end() - static_cast<long>(draws)),
          "a repeat has the same draws in every combination");
  const auto scene = plan.scene(run);
  if (!scene) {
    check_sentence(scene.error());
    promise(run > 0, "a study whose first run cannot be read is refused");
    return;
  }
  check_files(*scene, plan.scene_file(run));
}

}  // namespace

void take_study(std::string_view bytes) {
  const Json study = Json::parse(bytes, nullptr, false);
  if (takes_long(study)) return;
  const fs::path file = as_file(bytes, "study.json");
  const auto plan = study::Plan::read(file, folder(), false);
  if (!plan) return check_sentence(plan.error());
  promise(plan->runs() >= 1 && plan->runs() <= kMostRuns, "a study has runs, and not too many");
  for (const std::size_t run : {std::size_t{0}, plan->runs() / 2, plan->runs() - 1})
    check_run(*plan, study, run);
}

}  // namespace h6::fuzz
