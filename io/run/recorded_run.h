// SPDX-License-Identifier: Apache-2.0
// recorded_run.h - the settings of a run that its recording holds beside the scene. With them the
// run can be repeated bit for bit.
//
// The scene of a recording is in metres, so that reading it gives the same bits. A recording also
// holds the values that loading the scene derived: centres of mass and inertias.
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
  std::filesystem::path scene_file;  // for messages only; the scene itself names its parts
  Unit unit = Unit::m;               // unit of the scene that was run
  std::uint32_t threads = 1;
  bool virtual_time = false;
  std::size_t max_contacts = 0, max_pairs = 0;
  double frame_budget_us = 0;
  h6Vec3 gravity{};
  std::vector<h6BodyDef> bodies;              // in the order of the scene; shell and field are -1
  std::vector<h6DeviceCapabilities> ratings;  // of each hand's device
};

// The detail of a "settings" event: settings that a user changed during a run, first in words, then
// exactly, in braces. take_settings applies such a text to the definitions as they were before the
// change; it fails if it cannot read the text. The column `settings` of the recording tells from
// which frame on the change holds.
std::string settings_text(const h6ContactDef& contact, const h6CouplingDef& coupling);
Outcome take_settings(const std::string& text, h6ContactDef& contact, h6CouplingDef& coupling);

// The two texts of a recording's head. `scene` must have the settings of the run.
std::string run_text(const RecordedRun& run);
std::string recorded_scene_text(Scene scene);

// Reads the text of run_text from the head of a recording. Fails if it is missing.
Result<RecordedRun> recorded_run(const RecordingHead& head);

// Loads the scene again. It looks for the parts in their old places and beside `recording`. If a
// part is missing or has changed, it fails and names the part.
Result<std::unique_ptr<LoadedScene>> load_recorded(const RecordingHead& head,
                                                   const RecordedRun& run,
                                                   const std::filesystem::path& recording,
                                                   const Progress& progress = {});

}  // namespace h6::io
