// SPDX-License-Identifier: Apache-2.0
// run_scene.h - runs a loaded scene with its hands, watches it, records it, sums it up.
#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/console/console.h"
#include "io/record/recording.h"
#include "io/run/histogram.h"
#include "io/scene/load_scene.h"
#include "io/scene/verdict.h"

namespace h6::cli {

class RunObserver;

struct RunOptions {
  std::string device;   // empty: what the scene says for each hand
  double duration = 0;  // 0: the scene's [s]
  bool virtual_time = false;
  std::string method;  // empty: the scene's
  unsigned threads = 1;
  double spin_us = 0;
  double budget_us = 0;             // anytime mode; 0: off
  std::string record;               // empty: none
  std::string trace;                // .json timeline of the last seconds; empty: none
  RunObserver* observer = nullptr;  // with one the run has no end of its own
  std::size_t view_contacts = 0;    // rows of contacts kept for the observer
};

struct RunSummary {
  h6LoopReport loop{};
  io::Verdict verdict = io::Verdict::held;
  std::string method;
  double contacts_mean = 0;
  std::uint32_t contacts_max = 0;
  double max_depth_voxels = 0;
  double missed_depth_voxels = 0;  // of coarse frames, the bound
  double net_stiffness_max = 0;    // when the scene asks for it [N/m]
  Histogram frame_us, wakeup_us;
  std::array<Histogram, H6_STAGE_COUNT> stage_us;
  h6Pose final_pose{}, hand_pose{};
  double max_force = 0, max_torque = 0;  // as sent to the device [N], [N m]
  std::uint64_t state_hash = 0;
  std::vector<io::RecordingEvent> events;
  std::size_t events_dropped = 0;
  std::vector<float> depth_strip;  // deepest contact in each 1/60 of the run [voxel]
  std::string recording;
  double seconds = 0;  // asked for
  bool virtual_time = false;
  bool interrupted = false;
};

// A method or device that nothing here has: told before anything is read or baked.
Outcome check_options(const RunOptions& options);

Result<RunSummary> run_scene(const io::LoadedScene& scene, const RunOptions& options,
                             const Console& console);

// The object that `run --json` prints; lengths in the scene's units.
nlohmann::ordered_json to_json(const RunSummary& summary, const io::LoadedScene& scene,
                               bool virtual_time);

}  // namespace h6::cli
