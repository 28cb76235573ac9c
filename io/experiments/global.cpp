// SPDX-License-Identifier: Apache-2.0
// global.cpp - global scaling in the scenes in which the paper says that it fails.
#include "io/experiments/grid.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

struct Claim {
  const char* scene;
  const char* figure;
  const char* says;  // the paper's claim about global scaling
};
constexpr Claim kClaims[] = {
    {"cone-in-gap", "Fig. 3", "the cone slides in under the ceiling"},
    {"box-on-plates", "Fig. 7", "few contacts are outvoted by many"},
    {"rod-between-tubes", "Fig. 8, 20 N", "the rod goes through the gap"},
    {"peg-in-hole", "Fig. 10", "deeper than half a voxel"},
    {"box-over-wire", "Fig. 12", "the box goes over the wire"},
    {"box-over-post", "Fig. 12, upright", "the box goes through the post"},
};

struct Variant {
  const char* name;
  const char* method;
  double n0, force;
};
constexpr Variant kVariants[] = {
    {"n0 = 10", "global", 10, 1},         {"n0 = 5", "global", 5, 1},
    {"n0 = 2", "global", 2, 1},           {"n0 = 1", "global", 1, 1},
    {"n0 = 10, 1.5×", "global", 10, 1.5}, {"n0 = 10, 2×", "global", 10, 2},
    {"n0 = 10, 3×", "global", 10, 3},     {"robust", "robust", 0, 1},
};

bool fails(const RunFigures& run) { return !run.moved_on() || run.max_depth_voxels > 0.5; }

// For a scene in which n0 = 10 does not fail, a sentence with the variants of `global` that do.
std::string why_held(const Claim& claim, const std::vector<RunFigures>& runs) {
  if (fails(runs[0])) return "";
  std::string found;
  for (std::size_t v = 1; v < runs.size(); ++v)
    if (std::string(kVariants[v].method) == "global" && fails(runs[v]))
      found += std::string(found.empty() ? "" : "; ") + kVariants[v].name;
  return std::string("`") + claim.scene + "` holds with n0 = 10; it fails with " +
         (found.empty() ? "none of the others" : found) + ". ";
}

}  // namespace

Study study_global(const std::vector<MethodColumn>&, const Console& console) {
  Study out;
  out.title = "Where the paper says global scaling fails";
  out.about =
      "Verdict and deepest contact in voxels of global scaling, with n0 = 10 as McNeely's, and "
      "with less: on a flat wall its net stiffness is n0 k, and that of the paper's weights is "
      "k (see the study of net stiffness). Then n0 = 10 with the hand's force and stiffness "
      "multiplied. **Bold** marks a failure: not held, or deeper than half a voxel. The last "
      "column is `robust` in the unchanged scene.";
  constexpr std::size_t kCount = std::size(kVariants);
  std::vector<io::Scene> scenes;
  for (const Claim& claim : kClaims) {
    Result<io::Scene> scene = io::make_scene(claim.scene);
    if (!scene) return out;
    scenes.push_back(std::move(*scene));
  }
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  std::vector<std::vector<RunFigures>> runs(loaded.size(), std::vector<RunFigures>(kCount));
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < loaded.size(); ++s)
    for (std::size_t v = 0; v < kCount; ++v)
      jobs.push_back([&, s, v] {
        if (!loaded[s]) return;
        RunChange change;
        change.method = {kVariants[v].name, kVariants[v].method, kVariants[v].n0};
        change.force = kVariants[v].force;
        runs[s][v] = run_experiment(*loaded[s], change);
      });
  run_jobs(jobs, console, "global scaling");

  out.table = {{"scene", "the paper: with global scaling"}};
  for (const Variant& v : kVariants) out.table[0].push_back(v.name);
  for (std::size_t s = 0; s < loaded.size(); ++s) {
    out.table.push_back(
        {std::string(kClaims[s].scene) + " (" + kClaims[s].figure + ")", kClaims[s].says});
    for (std::size_t v = 0; v < kCount; ++v) {
      const std::string mark = fails(runs[s][v]) ? "**" : "";
      out.table.back().push_back(mark + cell(runs[s][v]) + mark);
      out.json[kClaims[s].scene][kVariants[v].name] = {
          {"verdict", io::verdict_name(runs[s][v].verdict)},
          {"max_depth_voxels", runs[s][v].max_depth_voxels},
          {"fails", fails(runs[s][v])}};
    }
  }
  for (std::size_t s = 0; s < loaded.size(); ++s) out.after += why_held(kClaims[s], runs[s]);
  if (!out.after.empty())
    out.after +=
        "The reason is the net stiffness: all of its contacts together are n0 = 10 times as stiff "
        "as those of a Gauss method, so that the few that resist keep a share ten times as large, "
        "at the price of an explicit limit ten times lower. Where the share of the few is less "
        "than a tenth of what is needed it fails at once; where it is more, it takes more force, "
        "or the smaller n0 that equal stiffness asks for.";
  return out;
}

}  // namespace h6::cli
