// SPDX-License-Identifier: Apache-2.0
// alpha.cpp - the alpha pushed at its shortcut in many directions (Fig. 8).
#include <algorithm>

#include "io/experiments/grid.h"

namespace h6::cli {
namespace {

constexpr int kPushes = 20;

struct Force {
  const char* name;
  double newtons;  // 0: contact stiffness times half a voxel
};
constexpr Force kForces[] = {{"20 N", 20}, {"half a voxel's force", 0}};

}  // namespace

Study study_pushes(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 8: the alpha pushed in 20 ways";
  out.about =
      "The hand leads the tool into the gap of alpha-shortcut and then pulls it away in 20 "
      "directions, spread at random over a cone of 30° around the strand's direction. Meanwhile "
      "it turns the tool six times by up to 0.6 rad about random axes. Forces: the scene's 20 "
      "N, and k times half a voxel. The table gives how many of the 20 pushes get through, and "
      "the least, median and greatest depth of their deepest contacts in voxels. \"Through\" "
      "means that a point of the tool was where it cannot be while the loops are linked, "
      "whatever the direction. A legitimate way out would show as a pass without deep contact.";
  const io::Scene scene = io::alpha_pushes();
  auto loaded = io::load_scene(scene);
  if (!loaded) return out;
  std::vector<io::Path> paths;
  for (int i = 0; i < kPushes; ++i) paths.push_back(io::alpha_push(i));
  constexpr std::size_t kForceCount = std::size(kForces);
  std::vector<RunFigures> runs(kForceCount * columns.size() * kPushes);
  std::vector<std::function<void()>> jobs;
  for (std::size_t f = 0; f < kForceCount; ++f)
    for (std::size_t m = 0; m < columns.size(); ++m)
      for (int i = 0; i < kPushes; ++i)
        jobs.push_back([&, f, m, i, at = (f * columns.size() + m) * kPushes + i] {
          RunChange change;
          change.method = columns[m];
          change.max_force = kForces[f].newtons;
          change.path = &paths[static_cast<std::size_t>(i)];
          runs[at] = run_experiment(**loaded, change);
        });
  run_jobs(jobs, console, "pushes");

  out.table = head("force", columns);
  for (std::size_t f = 0; f < kForceCount; ++f) {
    out.table.push_back({kForces[f].name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      int through = 0;
      std::vector<double> depths;
      nlohmann::ordered_json each = nlohmann::ordered_json::array();
      for (int i = 0; i < kPushes; ++i) {
        const RunFigures& run = runs[(f * columns.size() + m) * kPushes + i];
        through += run.verdict == io::Verdict::through;
        depths.push_back(run.max_depth_voxels);
        each.push_back({{"verdict", io::verdict_name(run.verdict)},
                        {"max_depth_voxels", run.max_depth_voxels}});
      }
      std::sort(depths.begin(), depths.end());
      const double median = 0.5 * (depths[kPushes / 2 - 1] + depths[kPushes / 2]);
      out.table.back().push_back(std::to_string(through) + ": " + number(depths.front(), 2) + ", " +
                                 number(median, 2) + ", " + number(depths.back(), 2));
      out.json[kForces[f].name][columns[m].name] = {{"through", through},        {"of", kPushes},
                                                    {"least", depths.front()},   {"median", median},
                                                    {"greatest", depths.back()}, {"runs", each}};
    }
  }
  return out;
}

}  // namespace h6::cli
