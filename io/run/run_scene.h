// SPDX-License-Identifier: Apache-2.0
// run_scene.h - runs a loaded scene with its hands, records the run and sums it up.
#pragma once
#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/console/console.h"
#include "io/record/late_judge.h"
#include "io/record/recording.h"
#include "io/run/run_tally.h"
#include "io/run/start_overlap.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

class RunObserver;

struct RunOptions {
  std::string device;   // if empty, each hand has the device that the scene names
  double duration = 0;  // [s]; 0 means the duration of the scene
  bool virtual_time = false;
  std::string method;  // if empty, the method of the scene
  unsigned threads = 1;
  double spin_us = 0;
  double budget_us = 0;             // frame budget of the anytime mode [us]; 0 turns it off
  double rearm = 0;                 // arms a faulty hand again after so long [s]; 0: never
  std::string record;               // file of the recording; empty for none
  std::string trace;                // .json timeline of the last seconds; empty for none
  std::string overlap;              // .csv of the points that overlap at the start; or empty
  RunObserver* observer = nullptr;  // ends the run if `duration` is 0
  std::size_t view_contacts = 0;    // rows of contacts kept for the observer
};

struct RunSummary : RunTotals, RunTimes {
  h6LoopReport loop{};
  std::string method;
  std::vector<PartOverlap> overlaps;  // at the start
  std::vector<io::RecordingEvent> events;
  std::size_t events_dropped = 0;
  std::array<std::uint64_t, 5> late{};  // late frames by io::LateCause
  double host_stole_ms = 0;             // a hypervisor kept all cores from us; < 0: not known
  std::vector<float> depth_strip;       // deepest contact in each 1/60 of the run [voxel]
  std::string recording;
  double seconds = 0;  // requested duration [s]
  bool virtual_time = false;
  bool interrupted = false;
};

// Fails for an unknown method or device. Call it before the scene is read and baked, so that the
// user does not wait for the error.
Outcome check_options(const RunOptions& options);

Result<RunSummary> run_scene(const io::LoadedScene& scene, const RunOptions& options,
                             const Console& console);

// These sentences tell a person about a run beside its figures.
std::vector<std::string> remarks(const RunTotals& run);

// The object that `run --json` prints, with lengths in the scene's units.
nlohmann::ordered_json to_json(const RunSummary& summary, const io::LoadedScene& scene,
                               bool virtual_time);

}  // namespace h6::cli
