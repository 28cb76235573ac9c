// experiments_motion.cpp - studies that run scenes again and again with one thing changed: the
// stiffness, the sampling of the shell, the force of the hand, the share of the small plate.
#include <algorithm>
#include <cmath>

#include "io/cli/experiments_studies.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;
using Loaded = std::unique_ptr<io::LoadedScene>;

TextTable head(const std::string& first, const std::vector<MethodColumn>& columns) {
  TextTable table(1, {first});
  for (const MethodColumn& c : columns) table[0].push_back(c.name);
  return table;
}

// All scenes of a study, loaded one after the other; those that fail are left empty.
std::vector<Loaded> load_all(std::vector<io::Scene> scenes) {
  std::vector<Loaded> out;
  for (io::Scene& scene : scenes) {
    auto loaded = io::load_scene(std::move(scene));
    out.push_back(loaded ? std::move(*loaded) : nullptr);
  }
  return out;
}

// ---- largest stable stiffness ------------------------------------------------------------------

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

// No bound that a pull of these paths reaches: a saturated coupling does not damp, and the question
// is what the contacts do. Softer contacts are deeper, which is not instability: nothing forbidden.
io::Scene for_stability(io::Scene scene) {
  scene.coupling.max_force = 20;
  scene.coupling.max_torque = 0.6;
  scene.verdict.forbidden.clear();
  return scene;
}

// The cone only as far as the ceiling, 5 mm into it.
io::Scene cone_at_ceiling() {
  io::Scene scene = io::cone_in_gap({0.5, 0, 1});
  io::HandPath hand(scene.hands[0].path.front().pose);
  hand.wait(0.05).move_by({0, 0, -0.6e-3}, 0.04).move_by({8e-3, 0, 0}, 0.05).wait(0.4);
  scene.hands[0].path = hand.rows();
  return scene;
}

// In doublings of the least stiffness; -1: not even that.
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
      "k in N/m, to a factor of two, at which the run is neither unstable nor chatters when the "
      "hand rests, over doublings from 500 N/m to 1.3e8 N/m (largest tried, smaller ones assumed "
      "no worse). Box pressed 3 mm to 4 mm on a wall and rocked, n points under it; peg of Fig. "
      "10; "
      "cone of Fig. 3 pulled 5 mm against the ceiling's edge. Coupling never saturated. The "
      "prototype, explicit, box with 25 / 100 / 400 points: none 8e3 / 2e3 / 5e2, global 1.6e4, "
      "gauss3 1.3e5, gauss6 6.4e4; implicit 3e7 or more for all; its limit is 4m/h² = 4e5 N/m for "
      "the net stiffness of a translation.";
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

// ---- other samplings of the shell --------------------------------------------------------------

Study study_sampling(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Other samplings of the shell";
  out.about =
      "Each scene with its shell at half, once and twice the points, on a regular grid and with "
      "every point moved inside its cell: failures (any verdict but held) of six, and the range of "
      "the deepest contact in voxels. Prototype, scenes of six in which a method fails at least "
      "once: global 5, gauss3 4, gauss6 1, robust 0, series 0.";
  std::vector<const TableScene*> kinds;
  for (const TableScene& s : table_scenes())
    if (s.thin) kinds.push_back(&s);
  std::vector<io::Sampling> variants;
  for (const double jitter : {0.0, 0.4})
    for (const double density : {0.5, 1.0, 2.0}) variants.push_back({density, jitter, 1});
  std::vector<io::Scene> scenes;
  for (const TableScene* kind : kinds)
    for (const io::Sampling& v : variants) scenes.push_back(kind->sampled(v));
  const std::vector<Loaded> loaded = load_all(std::move(scenes));

  std::vector<RunFigures> runs(loaded.size() * columns.size());
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < loaded.size(); ++s)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, s, m] {
        RunChange change;
        change.method = columns[m];
        RunFigures& run = runs[s * columns.size() + m];
        if (loaded[s])
          run = run_experiment(*loaded[s], change);
        else
          run.error = "not loaded";
      });
  run_jobs(jobs, console, "samplings");

  out.table = head("scene", columns);
  std::vector<int> failing(columns.size(), 0);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    out.table.push_back({kinds[k]->name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      int failures = 0;
      double low = 1e9, high = 0;
      ordered_json each = ordered_json::array();
      for (std::size_t v = 0; v < variants.size(); ++v) {
        const RunFigures& run = runs[(k * variants.size() + v) * columns.size() + m];
        failures += !run.moved_on();
        low = std::min(low, run.max_depth_voxels), high = std::max(high, run.max_depth_voxels);
        each.push_back({{"density", variants[v].density},
                        {"jitter", variants[v].jitter},
                        {"verdict", io::verdict_name(run.verdict)},
                        {"max_depth_voxels", run.max_depth_voxels}});
      }
      failing[m] += failures > 0;
      out.table.back().push_back(std::to_string(failures) + ": " + number(low, 2) + "–" +
                                 number(high, 2));
      out.json["scenes"][kinds[k]->name][columns[m].name] = {
          {"failures", failures}, {"low", low}, {"high", high}, {"runs", each}};
    }
  }
  out.table.push_back({"scenes with a failure"});
  for (std::size_t m = 0; m < columns.size(); ++m) {
    out.table.back().push_back(std::to_string(failing[m]) + " of " + std::to_string(kinds.size()));
    out.json["scenes_with_a_failure"][columns[m].name] = failing[m];
  }
  return out;
}

// ---- more force --------------------------------------------------------------------------------

Study study_force(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Pushed harder";
  out.about =
      "The highest multiple of the scene's force, of 1, 1.5, 2, 3, 4 and 6, up to which the "
      "verdict "
      "stays held; 0: not even once. Stiffness and bounds of the coupling grow together. "
      "Prototype: "
      "robust 2 in Fig. 3, 2 and 3 (post) in Fig. 12, 4 in Fig. 8; series 3, 4 and 6, 3. At 1 mm "
      "the "
      "fields of wire and post are never deeper than 0.29 voxel, so that they yield earlier; hence "
      "the two last rows, with fields of 0.25 mm.";
  std::vector<std::string> kinds;
  std::vector<io::Scene> scenes;
  for (const TableScene& s : table_scenes()) {
    if (!s.thin) continue;
    kinds.push_back(s.name);
    scenes.push_back(s.sampled(io::Sampling{}));
  }
  for (io::Scene& fine : std::vector<io::Scene>{io::box_over_wire({}), io::box_over_post({})}) {
    fine.coupling.max_force = 5;
    for (io::SceneBody& body : fine.bodies)
      if (body.field) body.field->bake.voxel_size = 0.25 * io::kMm;
    kinds.push_back(fine.name + ", 0.25 mm");
    scenes.push_back(std::move(fine));
  }
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  std::vector<double> held(kinds.size() * columns.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < kinds.size(); ++s)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, s, m] {
        for (const double force : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
          RunChange change;
          change.method = columns[m];
          change.force = force;
          if (!loaded[s] || !run_experiment(*loaded[s], change).moved_on()) return;
          held[s * columns.size() + m] = force;
        }
      });
  run_jobs(jobs, console, "more force");
  out.table = head("scene", columns);
  for (std::size_t s = 0; s < kinds.size(); ++s) {
    out.table.push_back({kinds[s]});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const double force = held[s * columns.size() + m];
      out.table.back().push_back(number(force, force == 1.5 ? 1 : 0) + "×");
      out.json[kinds[s]][columns[m].name] = force;
    }
  }
  return out;
}

// ---- how few contacts still count --------------------------------------------------------------

Study study_share(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 7: how few contacts are still heard";
  out.about =
      "Two plates of 5 mm under the box's ends, 100 contacts on one, a share of that on the other; "
      "verdict and depth at the end. Prototype, final depth for 1, .6, .4, .2, .1, .05, .02, .01: "
      "global .05 .07 .09 .16 .28 .53 pop pop; gauss3 .71 then pop; gauss6 .25 .34 then pop; "
      "robust .20 .23 .24 .25 .25 .20 .21 .25; series about .13 to .15. At .02 the plate is one "
      "voxel wide: both its sides lie on samples, its field has no inside at all, and every rule "
      "fails, `none` included.";
  const std::vector<double> shares = {1, 0.6, 0.4, 0.2, 0.1, 0.06, 0.02};
  std::vector<io::Scene> scenes;
  for (const double share : shares) scenes.push_back(io::box_on_plates_share(share));
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  std::vector<RunFigures> runs(shares.size() * columns.size());
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < shares.size(); ++s)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, s, m] {
        RunChange change;
        change.method = columns[m];
        if (loaded[s]) runs[s * columns.size() + m] = run_experiment(*loaded[s], change);
      });
  run_jobs(jobs, console, "plate shares");
  out.table = head("share", columns);
  for (std::size_t s = 0; s < shares.size(); ++s) {
    out.table.push_back({number(shares[s], 2)});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const RunFigures& run = runs[s * columns.size() + m];
      out.table.back().push_back(run.moved_on() ? "held " + number(run.final_depth_voxels, 2)
                                                : std::string(io::verdict_name(run.verdict)));
      out.json[number(shares[s], 2)][columns[m].name] = {
          {"verdict", io::verdict_name(run.verdict)},
          {"final_depth_voxels", run.final_depth_voxels}};
    }
  }
  return out;
}

// ---- finer fields ------------------------------------------------------------------------------

Study study_voxel(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Finer fields around thin parts";
  out.about =
      "Fig. 12's scenes with fields of 1, 0.5 and 0.25 mm and the same force of 5 N: verdict and "
      "deepest contact in mm. What changes with the voxel is the baked field's doing, what stays "
      "is "
      "the method's.";
  const std::vector<const char*> names = {"box-over-wire", "box-over-fused-wire", "box-over-post"};
  const std::vector<double> voxels = {1, 0.5, 0.25};  // [mm]
  std::vector<io::Scene> scenes;
  for (const char* name : names)
    for (const double voxel : voxels) {
      Result<io::Scene> scene = io::make_scene(name);
      if (!scene) return out;
      scene->coupling.max_force = 5;
      for (io::SceneBody& body : scene->bodies)
        if (body.field) body.field->bake.voxel_size = voxel * io::kMm;
      scenes.push_back(std::move(*scene));
    }
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  std::vector<RunFigures> runs(loaded.size() * columns.size());
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = 0; s < loaded.size(); ++s)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, s, m] {
        RunChange change;
        change.method = columns[m];
        if (loaded[s]) runs[s * columns.size() + m] = run_experiment(*loaded[s], change);
      });
  run_jobs(jobs, console, "finer fields");
  out.table = head("scene, voxel", columns);
  for (std::size_t s = 0; s < loaded.size(); ++s) {
    const char* name = names[s / voxels.size()];
    const double voxel = voxels[s % voxels.size()];
    const std::string size = number(voxel, 2) + " mm";
    out.table.push_back({std::string(name) + ", " + size});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const RunFigures& run = runs[s * columns.size() + m];
      const double depth = run.max_depth_voxels * voxel;
      out.table.back().push_back(std::string(io::verdict_name(run.verdict)) + " " +
                                 number(depth, 2));
      out.json[name][size][columns[m].name] = {{"verdict", io::verdict_name(run.verdict)},
                                               {"max_depth_mm", depth}};
    }
  }
  return out;
}

}  // namespace h6::cli
