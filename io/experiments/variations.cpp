// SPDX-License-Identifier: Apache-2.0
// variations.cpp - the scenes with one change each: the sampling of the shell, the force of the
// hand, or the voxels of the fields.
#include <algorithm>

#include "io/experiments/grid.h"
#include "io/experiments/vary_scene.h"

namespace h6::cli {
namespace {

Variation in_voxels(double factor) {
  Variation v;
  v.voxel = factor;
  return v;
}

// The scene with uniform voxels of this size, and its own force.
io::Scene with_voxels(const char* name, double size) {
  io::Scene scene = *vary(name, {});
  scene.coupling.max_force = largest_force(scene);
  for (io::SceneBody& body : scene.bodies) {
    if (!body.field) continue;
    body.field->bake.tolerance = 0, body.field->bake.voxel_size = size;
    body.field->keep = false;
  }
  return scene;
}

// A scene whose name is in the code always exists.
void add_varied(std::vector<io::Scene>& scenes, const char* name, const Variation& v) {
  if (Result<io::Scene> scene = vary(name, v)) scenes.push_back(std::move(*scene));
}

}  // namespace

// ---- other samplings of the shell --------------------------------------------------------------

Study study_sampling(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Other samplings of the shell";
  out.about =
      "Each scene with its shell at half, once and twice the points, on a regular grid and with "
      "every point moved at random inside its cell. The table gives the failures (any verdict "
      "but held) of these six runs, and the range of the deepest contact in voxels. Prototype, "
      "scenes of six in which a method fails at least once: global 5, gauss3 4, gauss6 1, "
      "robust 0, series 0.";
  std::vector<const TableScene*> kinds;
  for (const TableScene& s : table_scenes())
    if (s.thin) kinds.push_back(&s);
  std::vector<io::Sampling> variants;
  for (const double jitter : {0.0, 0.4})
    for (const double density : {0.5, 1.0, 2.0}) variants.push_back({density, jitter, 1});
  std::vector<io::Scene> scenes;
  for (const TableScene* kind : kinds)
    for (const io::Sampling& sampling : variants) {
      Variation v;
      v.sampling = sampling;
      add_varied(scenes, kind->name, v);
    }
  const std::vector<Loaded> loaded = load_all(std::move(scenes));

  const RunGrid runs = run_grid(loaded, columns, "samplings", console);

  out.table = head("scene", columns);
  std::vector<int> failing(columns.size(), 0);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    out.table.push_back({kinds[k]->name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      int failures = 0;
      double low = 1e9, high = 0;
      nlohmann::ordered_json each = nlohmann::ordered_json::array();
      for (std::size_t v = 0; v < variants.size(); ++v) {
        const RunFigures& run = runs[k * variants.size() + v][m];
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
      "verdict stays held; 0: it does not hold even the scene's own force. Stiffness and bounds "
      "of the coupling grow together. Prototype: robust 2 in Fig. 3, 2 and 3 (post) in Fig. 12, "
      "4 in Fig. 8; series 3, 4 and 6, 3. At 1 mm the fields of wire and post are never deeper "
      "than 0.29 voxel, so these yield earlier; the last two rows therefore use fields of 0.25 "
      "mm.";
  std::vector<std::string> kinds;
  std::vector<io::Scene> scenes;
  for (const TableScene& s : table_scenes()) {
    if (!s.thin) continue;
    kinds.push_back(s.name);
    add_varied(scenes, s.name, {});
  }
  for (const char* name : {"box-over-wire", "box-over-post"}) {
    kinds.push_back(std::string(name) + ", 0.25 mm");
    add_varied(scenes, name, in_voxels(0.25));
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

// ---- finer fields ------------------------------------------------------------------------------

Study study_voxel(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Finer fields around thin parts";
  out.about =
      "Fig. 12's scenes with uniform voxels of 1, 0.5 and 0.25 mm and the same force of 5 N: "
      "verdict and deepest contact in mm. Results that change with the voxel come from the baked "
      "field; results that stay come from the method. (The scene box-over-fused-wire itself has a "
      "tolerance in place of voxels.)";
  const std::vector<const char*> names = {"box-over-wire", "box-over-fused-wire", "box-over-post"};
  const std::vector<double> voxels = {1, 0.5, 0.25};  // [mm]
  std::vector<io::Scene> scenes;
  for (const char* name : names)
    for (const double voxel : voxels) scenes.push_back(with_voxels(name, voxel * 1e-3));
  const std::vector<Loaded> loaded = load_all(std::move(scenes));
  const RunGrid runs = run_grid(loaded, columns, "finer fields", console);
  out.table = head("scene, voxel", columns);
  for (std::size_t s = 0; s < loaded.size(); ++s) {
    const char* name = names[s / voxels.size()];
    const double voxel = voxels[s % voxels.size()];
    const std::string size = number(voxel, 2) + " mm";
    out.table.push_back({std::string(name) + ", " + size});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const RunFigures& run = runs[s][m];
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
