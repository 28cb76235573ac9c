// SPDX-License-Identifier: Apache-2.0
// scenes.h - the scenes of the experiments' table: the paper's claim about each, the figures of a
// prototype with analytic distances, and the runs.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "io/experiments/run.h"
#include "io/scenes/paper/experiments.h"

namespace h6::cli {

struct TableScene {
  const char* name;
  const char* figure;
  const char* claim;       // the paper's, in one sentence
  const char* difference;  // why the engine's row differs from the prototype's; may be empty
  bool thin;  // the shell is explicit and small; the studies of sampling and force use such scenes
  std::map<std::string, const char*> prototype;  // column -> its verdict and depth [voxel]
};
const std::vector<TableScene>& table_scenes();

// A scene's assets, safe to use from several threads: the first run loads them, the others share
// them.
class SharedScene {
 public:
  explicit SharedScene(std::function<Result<io::Scene>()> make) : make_(std::move(make)) {}
  // Null when the scene cannot be loaded: error() says why.
  const io::LoadedScene* get();
  const std::string& error() const { return error_; }

 private:
  std::function<Result<io::Scene>()> make_;
  std::mutex lock_;
  std::unique_ptr<io::LoadedScene> loaded_;
  std::string error_;
};

struct SceneRow {
  const TableScene* scene;
  std::vector<RunFigures> runs;  // one for each column
  std::vector<std::string> recordings;
};

// Runs all scenes with all columns; recordings go to `folder` unless it is empty.
std::vector<SceneRow> run_scene_table(const std::vector<const TableScene*>& scenes,
                                      const std::vector<MethodColumn>& columns,
                                      const std::string& folder, const Console& console);

// The verdict and the deepest contact [voxel], such as "held .21".
std::string cell(const RunFigures& run);

}  // namespace h6::cli
