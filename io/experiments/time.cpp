// SPDX-License-Identifier: Apache-2.0
// time.cpp - the time of a frame as a function of the number of contacts (Fig. 6).
#include <algorithm>

#include "io/experiments/probe.h"

namespace h6::cli {

Study study_time(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 6: time against the number of contacts";
  out.about =
      "A flat patch of n points, all in contact, on one thread: the median time in µs for "
      "finding the contacts, for their weights, and for wrench, coupling and solve (collision / "
      "weights / system). – means that the weights alone would take more than 2 s a frame. The "
      "paper: weights 25.6 % of the frame at n = 200, system 20 µs to 30 µs.";
  out.table = head("n", columns);
  const int sides[][2] = {{2, 5}, {10, 10}, {25, 40}, {100, 100}, {250, 400}};
  const io::Progress progress = console.progress();
  std::vector<double> per_contact2(columns.size(), 0);
  for (const auto& side : sides) {
    const int n = side[0] * side[1];
    out.table.push_back({std::to_string(n)});
    auto loaded =
        io::load_scene(posed_scene("patch", plate(-40 * kMm, 40 * kMm), bottom(side[0], side[1])));
    if (!loaded) continue;
    for (std::size_t m = 0; m < columns.size(); ++m) {
      if (interrupted.load()) return out;
      progress("times", static_cast<double>(out.table.size() - 2) / std::size(sides));
      Probe probe(**loaded, columns[m]);
      if (!probe || per_contact2[m] * n * n > 2e6) {
        out.table.back().push_back("–");
        continue;
      }
      std::vector<double> collision, weights, system;
      const int frames = n > 20000 ? 3 : n > 2000 ? 5 : 50;
      for (int i = 0; i < frames; ++i) {
        probe.at({{0, 0, 5 * kMm - kProbeDepth}, {1, 0, 0, 0}});
        const h6FrameReport r = probe.report();
        collision.push_back(r.stage_us[H6_STAGE_TRAVERSE] + r.stage_us[H6_STAGE_CONTACTS]);
        weights.push_back(r.stage_us[H6_STAGE_WEIGHTS]);
        system.push_back(r.stage_us[H6_STAGE_WRENCH] + r.stage_us[H6_STAGE_COUPLING] +
                         r.stage_us[H6_STAGE_INTEGRATE]);
      }
      const auto median = [](std::vector<double>& v) {
        std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
        return v[v.size() / 2];
      };
      const double c = median(collision), w = median(weights), s = median(system);
      // Only a method whose time grows with n^2 can take too long.
      per_contact2[m] = n >= 1000 && w > 1e-4 * n * n ? w / (1.0 * n * n) : 0;
      out.table.back().push_back(number(c, c < 10 ? 1 : 0) + " / " + number(w, w < 10 ? 1 : 0) +
                                 " / " + number(s, s < 10 ? 1 : 0));
      out.json[std::to_string(n)][columns[m].name] = {
          {"collision_us", c}, {"weights_us", w}, {"system_us", s}};
    }
  }
  progress("times", 1);
  return out;
}

}  // namespace h6::cli
