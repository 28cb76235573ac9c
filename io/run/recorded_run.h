// SPDX-License-Identifier: Apache-2.0
// recorded_run.h - what a recording holds about its run beside the scene, so that it can be run
// again to the bit.
//
// The scene of a recording is in metres, so that its numbers come back as they were. What loading a
// scene derives (centres of mass, inertias) is recorded as it was used.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/record/recording.h"
#include "io/scene/load_scene.h"

namespace h6::io {

struct RecordedRun {
  std::string generated;             // the scene's name in make_scene, or empty
  std::filesystem::path scene_file;  // for people; its parts are named in the scene
  Unit unit = Unit::m;               // of the scene that was run
  std::uint32_t threads = 1;
  bool virtual_time = false;
  std::size_t max_contacts = 0;
  double frame_budget_us = 0;
  h6Vec3 gravity{};
  std::vector<h6BodyDef> bodies;              // as scene.bodies; shell and field stay -1
  std::vector<h6DeviceCapabilities> ratings;  // of each hand's device
};

// Settings that a person changed during a run: the detail of a "settings" event, first in words,
// then in braces to the bit. take_settings reads it into the definitions as they were before, and
// fails where it cannot. The column `settings` says from which frame on they hold.
std::string settings_text(const h6ContactDef& contact, const h6CouplingDef& coupling);
Outcome take_settings(const std::string& text, h6ContactDef& contact, h6CouplingDef& coupling);

// The two texts of a recording's head. `scene` has the settings that it is run with.
std::string run_text(const RecordedRun& run);
std::string recorded_scene_text(Scene scene);

// Reads run_text. Fails where a recording has none.
Result<RecordedRun> recorded_run(const RecordingHead& head);

// Loads the scene again. Parts are looked for where they were and beside `recording`. Fails, naming
// the part, where one is gone or has changed.
Result<std::unique_ptr<LoadedScene>> load_recorded(const RecordingHead& head,
                                                   const RecordedRun& run,
                                                   const std::filesystem::path& recording,
                                                   const Progress& progress = {});

}  // namespace h6::io
