// SPDX-License-Identifier: Apache-2.0
// stability.cpp - the largest stable contact stiffness per method, sampling and integrator.
#include <cmath>

#include "io/experiments/grid.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

struct Setting {
  const char* name;
  int integrator;
  double damping;
};
constexpr Setting kSettings[] = {{"explicit, undamped", H6_EXPLICIT, 0},
                                 {"implicit, undamped", H6_IMPLICIT, 0},
                                 {"implicit, 1 ms", H6_IMPLICIT, 1e-3}};
constexpr double kLeastStiffness = 500;  // [N/m]
constexpr int kDoublings = 18;           // to 1.3e8 N/m

// The coupling's bound is put out of reach, because a saturated coupling does not damp and this
// study is about the contacts. No region is forbidden, because soft contacts go deep without being
// unstable.
io::Scene for_stability(io::Scene scene) {
  scene.coupling.max_force = 20;
  scene.coupling.max_torque = 0.6;
  if (scene.integrator == H6_EXPLICIT) scene.max_substeps = 1;  // the frame's own step is asked for
  scene.verdict.forbidden.clear();
  return scene;
}

// The cone's path ends 5 mm into the ceiling.
io::Scene cone_at_ceiling() {
  io::Scene scene = io::cone_in_gap({0.5, 0, 1});
  io::HandPath hand(scene.hands[0].path.front().pose);
  hand.wait(0.05).move_by({0, 0, -0.6e-3}, 0.04).move_by({8e-3, 0, 0}, 0.05).wait(0.4);
  scene.hands[0].path = hand.rows();
  return scene;
}

// The largest stable stiffness, in doublings of the least; -1 when the least is unstable.
int largest_stable(const io::LoadedScene& loaded, RunChange change) {
  const auto stable = [&](int doublings) {
    change.stiffness = kLeastStiffness * std::exp2(doublings);
    const RunFigures run = run_experiment(loaded, change);
    return run.error.empty() && run.verdict != io::Verdict::unstable &&
           run.verdict != io::Verdict::chatters;
  };
  if (stable(kDoublings)) return kDoublings;
  int low = -1, high = kDoublings;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

std::string stiffness_text(int doublings) {
  if (doublings < 0) return "< 500";
  char text[32];
  std::snprintf(text, sizeof text, "%s%.1e", doublings == kDoublings ? "≥ " : "",
                kLeastStiffness * std::exp2(doublings));
  return text;
}

}  // namespace

Study study_stability(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Largest stable stiffness";
  out.about =
      "The largest stable k in N/m, to a factor of two: the run is not unstable and does not "
      "chatter while the hand rests. Tried are doublings from 500 N/m to 1.3e8 N/m; smaller "
      "ones are assumed no worse. The scenes: a box pressed 3 mm to 4 mm onto a wall and "
      "rocked, with n points under it; the peg of Fig. 10; the cone of Fig. 3 pulled 5 mm "
      "against the ceiling's edge. The coupling is never saturated. The prototype, explicit, "
      "box with 25 / 100 / 400 points: none 8e3 / 2e3 / 5e2, global 1.6e4, gauss3 1.3e5, gauss6 "
      "6.4e4; its limit is 4m/h² = 4e5 N/m for the net stiffness of a translation. Implicitly "
      "it holds 1.6e7 or more with box and peg (a tube without a floor). With its cone, on "
      "exact distances, it holds only 2.6e5 (`none`) and 1e6 (`gauss3`, `robust`): less than "
      "the engine below, and no more with the engine's path and criterion. The instability is "
      "not a growing mode but a cycle of impacts: where k h² is much larger than m, a step "
      "throws a contact out at the speed depth/h in one frame, onto the opposite surface. The "
      "limit therefore depends on the frame time: at 2 kHz the undamped cone holds four times "
      "as much, at 10 kHz every k. `series` holds the peg alone in its tube at every k. In the "
      "corner of wall and floor, which samples 1 mm apart round off (N·g = 0.72), its limit is "
      "2e6; with a field of 0.5 mm it is 3.3e7, and with 0.25 mm there is none. Such cycles "
      "have windows: at 1 mm it holds again from 8e6 to 3.3e7. The exact gradient does not "
      "help: peg `none` and `robust` then hold at every k, `series` to 8e6, but the cone, which "
      "touches an edge where N·g = 0.63, is unstable from 5e5 on. Contact damping of 1 ms "
      "lowers a limit because it may not pull: with it the prototype's `gauss3` holds 2e6 on "
      "the cone, but 5e5, as here, once its contacts do not pull either.";
  std::vector<io::Scene> scenes;
  std::vector<std::string> names;
  for (const int side : {5, 10, 20}) {
    scenes.push_back(for_stability(io::box_on_wall_explicit(side, side)));
    names.push_back("box, " + std::to_string(side * side));
  }
  scenes.push_back(for_stability(io::peg_in_hole({0.25, 0, 1})));
  scenes.push_back(for_stability(io::peg_in_hole({1, 0, 1})));
  scenes.push_back(for_stability(cone_at_ceiling()));
  names.insert(names.end(), {"peg, 600", "peg, 2400", "cone"});
  const std::vector<Loaded> loaded = load_all(std::move(scenes));

  const std::size_t settings = std::size(kSettings);
  std::vector<int> found(loaded.size() * settings * columns.size(), -1);
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = loaded.size(); s-- > 0;)
    for (std::size_t k = 0; k < settings; ++k)
      for (std::size_t m = 0; m < columns.size(); ++m) {
        if (!loaded[s]) continue;
        RunChange change;
        change.method = columns[m];
        change.integrator = kSettings[k].integrator;
        change.damping = kSettings[k].damping;
        jobs.push_back([&, change, s, at = (s * settings + k) * columns.size() + m] {
          found[at] = largest_stable(*loaded[s], change);
        });
      }
  run_jobs(jobs, console, "stability");

  out.table = head("scene, integration", columns);
  for (std::size_t s = 0; s < loaded.size(); ++s)
    for (std::size_t k = 0; k < settings; ++k) {
      out.table.push_back({names[s] + ", " + kSettings[k].name});
      for (std::size_t m = 0; m < columns.size(); ++m) {
        const int doublings = found[(s * settings + k) * columns.size() + m];
        out.table.back().push_back(stiffness_text(doublings));
        out.json[names[s]][kSettings[k].name][columns[m].name] =
            doublings < 0 ? 0 : kLeastStiffness * std::exp2(doublings);
      }
    }
  return out;
}

}  // namespace h6::cli
