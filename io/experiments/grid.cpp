// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/grid.h"

namespace h6::cli {

TextTable head(const std::string& first, const std::vector<MethodColumn>& columns) {
  TextTable table(1, {first});
  for (const MethodColumn& c : columns) table[0].push_back(c.name);
  return table;
}

std::vector<Loaded> load_all(std::vector<io::Scene> scenes) {
  std::vector<Loaded> out;
  for (io::Scene& scene : scenes) {
    auto loaded = io::load_scene(std::move(scene));
    out.push_back(loaded ? std::move(*loaded) : nullptr);
  }
  return out;
}

RunGrid run_grid(const std::vector<Loaded>& scenes, const std::vector<MethodColumn>& columns,
                 const std::string& label, const Console& console) {
  RunGrid runs(scenes.size(), std::vector<RunFigures>(columns.size()));
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < scenes.size(); ++s)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, s, m] {
        RunChange change;
        change.method = columns[m];
        if (scenes[s])
          runs[s][m] = run_experiment(*scenes[s], change);
        else
          runs[s][m].error = "not loaded";
      });
  run_jobs(jobs, console, label);
  return runs;
}

}  // namespace h6::cli
