// SPDX-License-Identifier: Apache-2.0
// share.cpp - the box on two plates (Fig. 7) with fewer and fewer contacts on one of them.
#include "io/experiments/grid.h"

namespace h6::cli {

Study study_share(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 7: how few contacts are still heard";
  out.about =
      "Two plates of 5 mm under the box's ends: 100 contacts on one, a share of that number on "
      "the other. The table gives the verdict and the depth at the end in mm. Prototype, for 1, "
      ".6, .4, .2, .1, .05, .02, .01: global .05 .07 .09 .16 .28 .53 pop pop; gauss3 .71 then "
      "pop; gauss6 .25 .34 then pop; robust .20 .23 .24 .25 .25 .20 .21 .25; series about .13 "
      "to .15. From .05 on, the share is five, two and one contact of one row, on a plate of 1 "
      "mm. Fields of 1 mm would have no inside there, so these rows use voxels of 0.25 mm, with "
      "force, l0, margin and cluster distance kept at their lengths.";
  const std::vector<double> shares = {1, 0.6, 0.4, 0.2, 0.1, 0.06, 0.05, 0.02, 0.01};
  std::vector<io::Scene> scenes;
  for (const double share : shares) scenes.push_back(io::box_on_plates_share(share));
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  const RunGrid runs = run_grid(loaded, columns, "plate shares", console);
  out.table = head("share", columns);
  for (std::size_t s = 0; s < shares.size(); ++s) {
    out.table.push_back({number(shares[s], 2)});
    const double voxel = loaded[s] ? loaded[s]->assets.front().voxel_size : 0;
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const RunFigures& run = runs[s][m];
      const double depth = run.final_depth_voxels * voxel / io::kMm;
      out.table.back().push_back(run.moved_on() ? "held " + number(depth, 2)
                                                : std::string(io::verdict_name(run.verdict)));
      out.json[number(shares[s], 2)][columns[m].name] = {
          {"verdict", io::verdict_name(run.verdict)},
          {"final_depth_voxels", run.final_depth_voxels},
          {"final_depth_mm", depth}};
    }
  }
  return out;
}

}  // namespace h6::cli
