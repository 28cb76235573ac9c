// SPDX-License-Identifier: Apache-2.0
// map.h - the robustness map: every scene, many variations of it, several weight methods. The
// scenes, their variations and the forces are the same for all methods, so runs can be compared
// in pairs.
//
// Each variation runs under three forces, and twice: once with the scene's stiffness k for every
// method, and once with a k for each method that makes a flat wall equally stiff.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/experiments/run.h"
#include "io/experiments/vary_scene.h"

namespace h6::cli {

inline constexpr int kMapForces = 3, kMapTables = 2;
enum MapForce { kHalfVoxelForce, kSceneForce, kPushForce };
enum MapTable { kEqualStiffness, kEqualWall };

struct MapOptions {
  std::vector<MethodColumn> methods;  // the first one is what the others are compared with
  std::vector<std::string> scenes;    // empty: all that do not take too long
  std::size_t variations = 36;
  std::uint64_t seed = 1;
  int jobs = 2;
  std::optional<std::size_t> only;  // of the variations, this one alone
};

struct MapRun {
  io::Verdict verdict = io::Verdict::held;
  bool held = false;
  bool torque_noise = false;                    // see RunFigures
  double depth = 0;                             // deepest point [voxel]
  double late_speed = 0, late_depth_swing = 0;  // see RunTotals: why it chatters
  std::string error;
};

struct MapVariation {
  std::size_t index = 0;
  std::uint64_t seed = 0;
  Variation change;
  double newtons[kMapForces] = {};  // the coupling's largest force
  std::string error;                // why the scene could not be made; then there are no runs
  std::vector<MapRun> runs;
  const MapRun& run(int table, int force, std::size_t method) const {
    return runs[(method * kMapTables + static_cast<std::size_t>(table)) * kMapForces +
                static_cast<std::size_t>(force)];
  }
};

struct MapScene {
  std::string name;
  std::string left_out;         // why there are no variations; empty when there are
  bool explicit_steps = false;  // a step that is too long is unstable under any rule
  std::vector<double> stiffer;  // of each method: factor of k that makes the wall equally stiff
  std::vector<MapVariation> variations;
};

// How the hand of a run pushes: with up to `newtons` [N], the force that the variation has under
// `force`, and for half a voxel also with the torque of half a voxel.
RunChange map_change(double newtons, MapForce force, const Variation& by);

std::vector<MapScene> run_map(const MapOptions& options, const Console& console);

// The map in parts, for runs on other machines. A job is one variation of one scene.
struct MapPlan {
  std::vector<MapScene> scenes;  // with their variations drawn and nothing run
  struct Job {
    std::size_t scene, variation;
  };
  std::vector<Job> jobs;
};
MapPlan plan_map(const MapOptions& options);
void run_job(const MapOptions& options, MapPlan& plan, std::size_t job);
// The runs of a job as one line of text, and back to the bit. False: this is no such line.
std::string job_line(const MapPlan& plan, std::size_t job);
bool take_job_line(MapPlan& plan, std::size_t job, const std::string& line);
// Whether a job has neither runs nor an error yet.
bool is_open(const MapPlan& plan, std::size_t job);
// Runs the open jobs on threads of this process. `ended` gets each job that has ended and how long
// it took, one at a time; when it fails no further job begins, and its sentence is returned.
Outcome run_open_jobs(const MapOptions& options, MapPlan& plan, const Console& console,
                      const std::function<Outcome(std::size_t job, double seconds)>& ended);
std::vector<MapScene> finish_map(MapPlan&& plan);

// The method's net stiffness on a flat wall, in k: the slope of the contact force of a box's bottom
// of 20 x 20 mm with 40 x 40 points that is pressed onto a plate. Zero when it cannot be measured.
double wall_stiffness(const h6ContactDef& contact, const MethodColumn& method);

// Names of generated scenes that the map knows, and the methods that it compares by default.
std::vector<std::string> map_scene_names();
std::vector<MethodColumn> map_methods();

}  // namespace h6::cli
