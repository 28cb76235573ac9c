// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/map.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>

#include "io/experiments/probe.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

// Scenes that only run when they are asked for by name.
struct Slow {
  const char* scene;
  const char* why;
};
constexpr Slow kSlow[] = {
    {"spline-hub-10k", "a frame takes milliseconds; --scenes spline-hub-10k runs it"},
    {"spline-hub-100k", "a frame takes tens of milliseconds; --scenes spline-hub-100k runs it"},
    {"bridge-and-dinosaur",
     "each variation takes the modes of 85,018 points anew; --scenes bridge-and-dinosaur runs it"},
    {"clip-and-rod", "each variation takes the modes anew; --scenes clip-and-rod runs it"},
    {"hose-in-bracket", "each variation takes the modes anew; --scenes hose-in-bracket runs it"},
    {"engine-bay", "each variation bakes 505,276 triangles anew; --scenes engine-bay runs it"},
    {"landing-gear",
     "each variation bakes 1,789,551 triangles anew; --scenes landing-gear runs it"}};

MapRun run_once(const io::LoadedScene& loaded, const MethodColumn& method, double stiffness,
                double newtons, MapForce force, const Variation& by) {
  RunChange change = map_change(newtons, force, by);
  change.method = method;
  change.stiffness = stiffness;
  const RunFigures figures = run_experiment(loaded, change);
  return {
      figures.verdict,    figures.moved_on(),       figures.torque_noise, figures.max_depth_voxels,
      figures.late_speed, figures.late_depth_swing, figures.error};
}

void run_variation(const MapScene& scene, const std::vector<MethodColumn>& methods,
                   MapVariation& v) {
  Result<io::Scene> made = vary(scene.name, v.change);
  if (!made) return void(v.error = made.error());
  v.newtons[kHalfVoxelForce] = half_voxel_force(*made);
  v.newtons[kSceneForce] = largest_force(*made);
  v.newtons[kPushForce] = v.change.push * largest_force(*made);
  const double stiffness = made->contact.stiffness;
  const auto loaded = io::load_scene(std::move(*made));
  if (!loaded) return void(v.error = loaded.error());
  for (std::size_t m = 0; m < methods.size(); ++m)
    for (int table = 0; table < kMapTables; ++table) {
      const double factor = table == kEqualWall ? scene.stiffer[m] : 1;
      for (int force = 0; force < kMapForces; ++force) {
        if (interrupted.load()) return;
        if (table == kEqualWall && factor == 1)  // the same run again
          v.runs.push_back(v.run(kEqualStiffness, force, m));
        else
          v.runs.push_back(run_once(**loaded, methods[m], factor * stiffness, v.newtons[force],
                                    static_cast<MapForce>(force), v.change));
      }
    }
}

// The scene with its variations drawn and nothing run yet.
MapScene planned(const std::string& name, const MapOptions& options) {
  MapScene out;
  out.name = name;
  if (options.scenes.empty())
    for (const Slow& slow : kSlow)
      if (name == slow.scene) out.left_out = slow.why;
  const Result<io::Scene> scene = io::make_scene(name);
  if (!scene) out.left_out = scene.error();
  if (!out.left_out.empty()) return out;
  out.explicit_steps = scene->integrator == H6_EXPLICIT;
  std::vector<double> walls;
  for (const MethodColumn& method : options.methods)
    walls.push_back(wall_stiffness(scene->contact, method));
  for (const double wall : walls) {
    out.stiffer.push_back(wall == walls[0] ? 1 : walls[0] / wall);
    if (!(wall > 0)) out.left_out = "the stiffness of a flat wall cannot be measured";
  }
  for (std::size_t i = 0; i < options.variations; ++i) {
    if (options.only && i != *options.only) continue;
    MapVariation v;
    v.index = i;
    v.seed = seed_in_series(options.seed, name, i);
    v.change = draw_variation(kind_in_series(i), v.seed);
    out.variations.push_back(std::move(v));
  }
  return out;
}

}  // namespace

RunChange map_change(double newtons, MapForce force, const Variation& by) {
  RunChange change;
  change.force = force == kPushForce ? by.push : 1;
  change.max_force = newtons / change.force;  // which multiplies it, and the coupling's stiffness
  // A scene's largest torque is for its own voxel, and half a voxel is less where voxels are finer.
  if (force == kHalfVoxelForce)
    change.also = [voxel = by.voxel](h6SessionDef&, h6HandDef& hand) {
      hand.coupling.max_torque *= voxel;
    };
  return change;
}

double wall_stiffness(const h6ContactDef& contact, const MethodColumn& method) {
  io::Scene scene = posed_scene("wall", plate(-40 * kMm, 40 * kMm), bottom(40, 40));
  scene.contact = contact;
  const auto loaded = io::load_scene(std::move(scene));
  if (!loaded) return 0;
  Probe probe(**loaded, method);
  if (!probe) return 0;
  const auto pressed = [&](double depth) {
    return elastic_wrench(probe.at({{0, 0, 5 * kMm - depth}, {1, 0, 0, 0}}), 1).force.z;
  };
  constexpr double kStep = 0.01 * kProbeVoxel;
  return (pressed(kProbeDepth + kStep) - pressed(kProbeDepth - kStep)) / (2 * kStep);
}

std::vector<std::string> map_scene_names() {
  std::vector<std::string> out;
  for (const io::SceneName& scene : io::scene_names()) out.push_back(scene.name);
  return out;
}

std::vector<MethodColumn> map_methods() {
  std::vector<MethodColumn> out;
  for (const char* name : {"robust", "gauss6", "series", "firm"})
    for (const MethodColumn& column : method_columns())
      if (column.name == name) out.push_back(column);
  return out;
}

MapPlan plan_map(const MapOptions& options) {
  MapPlan out;
  for (const std::string& name : options.scenes.empty() ? map_scene_names() : options.scenes)
    out.scenes.push_back(planned(name, options));
  for (std::size_t s = out.scenes.size(); s-- > 0;)  // in reverse: the last scenes take longest
    if (out.scenes[s].left_out.empty())
      for (std::size_t v = 0; v < out.scenes[s].variations.size(); ++v) out.jobs.push_back({s, v});
  return out;
}

void run_job(const MapOptions& options, MapPlan& plan, std::size_t job) {
  MapScene& scene = plan.scenes[plan.jobs[job].scene];
  run_variation(scene, options.methods, scene.variations[plan.jobs[job].variation]);
}

std::string job_line(const MapPlan& plan, std::size_t job) {
  const MapVariation& v = plan.scenes[plan.jobs[job].scene].variations[plan.jobs[job].variation];
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  nlohmann::json runs = nlohmann::json::array();
  for (const MapRun& r : v.runs)
    runs.push_back({static_cast<int>(r.verdict), r.held, r.torque_noise, bits(r.depth),
                    bits(r.late_speed), bits(r.late_depth_swing), r.error});
  nlohmann::json newtons = nlohmann::json::array();
  for (const double n : v.newtons) newtons.push_back(bits(n));
  return nlohmann::json{{"error", v.error}, {"newtons", newtons}, {"runs", runs}}.dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool take_job_line(MapPlan& plan, std::size_t job, const std::string& line) try {
  MapVariation& v = plan.scenes[plan.jobs[job].scene].variations[plan.jobs[job].variation];
  const auto number = [](const nlohmann::json& x) {
    return std::bit_cast<double>(x.get<std::uint64_t>());
  };
  const nlohmann::json all = nlohmann::json::parse(line);
  v.error = all.at("error");
  for (std::size_t i = 0; i < kMapForces; ++i) v.newtons[i] = number(all.at("newtons").at(i));
  const std::size_t scene = plan.jobs[job].scene;
  const std::size_t whole = kMapForces * kMapTables * plan.scenes[scene].stiffer.size();
  if (all.at("runs").size() != (v.error.empty() ? whole : 0)) return false;
  v.runs.clear();
  for (const nlohmann::json& r : all.at("runs"))
    v.runs.push_back({static_cast<io::Verdict>(r.at(0).get<int>()), r.at(1), r.at(2),
                      number(r.at(3)), number(r.at(4)), number(r.at(5)), r.at(6)});
  return true;
} catch (const nlohmann::json::exception&) {
  return false;
}

// A scene that can never be varied has no rows.
std::vector<MapScene> finish_map(MapPlan&& plan) {
  for (MapScene& scene : plan.scenes) {
    const auto made = [](const MapVariation& v) { return v.error.empty(); };
    const auto& all = scene.variations;
    if (scene.left_out.empty() && !all.empty() && std::none_of(all.begin(), all.end(), made))
      scene.left_out = all.front().error;
  }
  return std::move(plan.scenes);
}

bool is_open(const MapPlan& plan, std::size_t job) {
  const MapVariation& v = plan.scenes[plan.jobs[job].scene].variations[plan.jobs[job].variation];
  return v.runs.empty() && v.error.empty();
}

Outcome run_open_jobs(const MapOptions& options, MapPlan& plan, const Console& console,
                      const std::function<Outcome(std::size_t job, double seconds)>& ended) {
  std::mutex lock;
  Outcome all = Done{};
  std::vector<std::function<void()>> jobs;
  for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
    if (!is_open(plan, i)) continue;
    jobs.push_back([&, i] {
      if (const std::lock_guard<std::mutex> hold(lock); !all) return;
      const auto start = std::chrono::steady_clock::now();
      run_job(options, plan, i);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      if (interrupted.load()) return;  // it may have only some of its runs
      const std::lock_guard<std::mutex> hold(lock);
      if (Outcome kept = ended(i, took.count()); !kept) all = kept;
    });
  }
  run_jobs(jobs, console, "variations", options.jobs);
  return all;
}

std::vector<MapScene> run_map(const MapOptions& options, const Console& console) {
  MapPlan plan = plan_map(options);
  (void)run_open_jobs(options, plan, console, [](std::size_t, double) { return Outcome(Done{}); });
  return finish_map(std::move(plan));
}

}  // namespace h6::cli
