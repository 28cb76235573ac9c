// SPDX-License-Identifier: Apache-2.0
// recorded_run.h - what a recording says of its run beside the scene, so that it can be run again
// to the bit.
//
// The scene of a recording is in metres: so its numbers come back as they were. What is derived
// when a scene is loaded (centres of mass, inertias) stands here as it was used.
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

// What a person changed while it ran: the detail of a "settings" event, for people and, in braces
// at its end, to the bit. Back into definitions that hold what was before; a sentence where it
// cannot be read. Column `settings` says from which frame on.
std::string settings_text(const h6ContactDef& contact, const h6CouplingDef& coupling);
Outcome take_settings(const std::string& text, h6ContactDef& contact, h6CouplingDef& coupling);

// The two texts of a recording's head. `scene` with the settings it is run with.
std::string run_text(const RecordedRun& run);
std::string recorded_scene_text(Scene scene);

// And back. A sentence where the recording was made without.
Result<RecordedRun> recorded_run(const RecordingHead& head);

// The scene, loaded again. Parts are looked for where they were and beside `recording`; one that is
// gone or is not what was recorded is a sentence that names it.
Result<std::unique_ptr<LoadedScene>> load_recorded(const RecordingHead& head,
                                                   const RecordedRun& run,
                                                   const std::filesystem::path& recording,
                                                   const Progress& progress = {});

}  // namespace h6::io
