// SPDX-License-Identifier: Apache-2.0
// run_scene.h - runs a loaded scene with its hands, watches it, records it, sums it up.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/console/console.h"
#include "io/record/recording.h"
#include "io/run/run_tally.h"
#include "io/scene/load_scene.h"

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
  RunObserver* observer = nullptr;  // ends the run, where `duration` is 0
  std::size_t view_contacts = 0;    // rows of contacts kept for the observer
};

struct RunSummary : RunTotals, RunTimes {
  h6LoopReport loop{};
  std::string method;
  std::vector<io::RecordingEvent> events;
  std::size_t events_dropped = 0;
  std::vector<float> depth_strip;  // deepest contact in each 1/60 of the run [voxel]
  std::string recording;
  double seconds = 0;  // asked for
  bool virtual_time = false;
  bool interrupted = false;
};

// Refuses an unknown method or device before anything is read or baked.
Outcome check_options(const RunOptions& options);

Result<RunSummary> run_scene(const io::LoadedScene& scene, const RunOptions& options,
                             const Console& console);

// The object that `run --json` prints; lengths in the scene's units.
nlohmann::ordered_json to_json(const RunSummary& summary, const io::LoadedScene& scene,
                               bool virtual_time);

}  // namespace h6::cli
