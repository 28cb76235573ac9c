// SPDX-License-Identifier: Apache-2.0
// level_set_frame_bench.cpp - times the frames of generated scenes whose field is our own bake, and
// those on the level set that OpenVDB's meshToLevelSet makes of the same mesh with the same voxel:
//     frame/level_set/SCENE/(own|openvdb)
// The hand follows the scene's path once for each time. Before, one more time, contacts are
// compared with a test of all points in every 20th frame of one step.
#include <benchmark/benchmark.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "io/scene/load_scene.h"
#include "io/scenes/scenes.h"
#include "level_set_peer.h"

namespace {

using namespace h6;
using Loaded = std::unique_ptr<io::LoadedScene>;

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, SessionDeleter>;

// The scene with a level set in the place of its bake; null when it cannot be loaded.
Loaded on_level_set(const io::LoadedScene& own) {
  io::Scene scene = own.scene;
  const auto file = std::filesystem::temp_directory_path() /
                    ("hapsix_level_set_" + std::to_string(getpid()) + ".vdb");
  for (io::SceneBody& body : scene.bodies) {
    if (!body.field) continue;
    h6::bench::write_mesh_as_level_set(*body.field->mesh_data, own.field_voxels[0], file);
    body.field.emplace().file = file;
  }
  auto loaded = io::load_scene(scene);
  std::filesystem::remove(file);
  return loaded ? std::move(*loaded) : nullptr;
}

Loaded load(const std::string& name, bool foreign) {
  auto own = io::load_scene(*io::make_scene(name));
  if (!own) return nullptr;
  return foreign ? on_level_set(**own) : std::move(*own);
}

// Follows the path and calls seen(body's pose before, report) after every frame.
template <class F>
void follow(const io::LoadedScene& scene, F&& seen) {
  const h6SessionDef def = scene.session_def();
  const Session session(h6CreateSession(scene.model.get(), &def, nullptr));
  const io::Path& path = scene.scene.hands[0].path;
  h6Arm(session.get());
  for (double t = 0; t < path.back().t; t += 1 / scene.scene.rate) {
    h6DeviceSample sample{};
    sample.pose = io::sample_path(path, t);
    sample.velocity = io::sample_path_velocity(path, t);
    const h6Pose before = h6GetBody(session.get(), 1).pose;
    h6Step(session.get(), &sample, nullptr);
    seen(before, h6GetFrame(session.get()));
  }
}

// Points within a thousandth of a voxel of the surface may differ.
bool finds_all(const io::LoadedScene& scene) {
  const double near = 1e-3 * scene.field_voxels[0];
  const std::vector<h6Vec3>& shell = scene.watched_points();
  std::vector<double> points(3 * shell.size()), depth(shell.size());
  bool all = true;
  int frame = 0;
  follow(scene, [&](const h6Pose& pose, const h6FrameReport& report) {
    if (frame++ % 20 != 0 || report.substeps != 1) return;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      const h6Vec3 p = place(pose, shell[i]);
      points[3 * i] = p.x, points[3 * i + 1] = p.y, points[3 * i + 2] = p.z;
    }
    h6SampleField(scene.model.get(), 0, points.data(), shell.size(), depth.data(), nullptr,
                  nullptr);
    const auto below = [&](double limit) {
      return std::count_if(depth.begin(), depth.end(), [&](double d) { return d < limit; });
    };
    const auto found = static_cast<std::ptrdiff_t>(report.contacts);
    all &= below(-near) <= found && found <= below(near);
  });
  return all;
}

void frame(benchmark::State& state, const std::string& name, bool foreign) {
  const Loaded scene = load(name, foreign);
  if (!scene) return state.SkipWithError("no scene");
  if (!finds_all(*scene)) return state.SkipWithError("contacts differ from a test of all points");
  std::vector<double> times, traversal;
  double contacts = 0, deepest = 0;
  for (auto _ : state) {
    const std::size_t first = times.size();
    follow(*scene, [&](const h6Pose&, const h6FrameReport& report) {
      times.push_back(report.frame_us);
      traversal.push_back(report.stage_us[H6_STAGE_TRAVERSE]);
      contacts += report.contacts;
      deepest = std::max(deepest, report.max_depth_voxels);
    });
    double sum = 0;
    for (std::size_t i = first; i < times.size(); ++i) sum += times[i];
    state.SetIterationTime(1e-6 * sum / static_cast<double>(times.size() - first));
  }
  const auto at = [](std::vector<double>& t, double p) {
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  };
  state.counters["contacts"] = contacts / static_cast<double>(times.size());
  state.counters["deepest_voxels"] = deepest;
  state.counters["p50_us"] = at(times, 0.5);
  state.counters["p99_us"] = at(times, 0.99);
  state.counters["traverse_us"] = at(traversal, 0.5);
}

[[maybe_unused]] const bool registered = [] {
  for (const char* scene : {"alpha-shortcut", "piston-in-bore", "nut-on-bolt", "spline-hub-10k"})
    for (const bool foreign : {false, true})
      benchmark::RegisterBenchmark(
          ("frame/level_set/" + std::string(scene) + (foreign ? "/openvdb" : "/own")).c_str(),
          frame, scene, foreign)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(1);
  return true;
}();

}  // namespace
