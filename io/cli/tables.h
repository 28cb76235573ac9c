// SPDX-License-Identifier: Apache-2.0
// tables.h - the summaries of runs as tables for a terminal.
#pragma once
#include <string>
#include <vector>

#include "io/run/run_scene.h"

namespace h6::cli {

// One row for each run: method, contacts, deepest point, frame times, late frames by cause,
// verdict.
std::string table(const std::vector<RunSummary>& runs);
// Late frames by cause and delay, and coarse frames; empty when there were none.
std::string late_table(const RunSummary& run);
// A chart of the deepest contact over time with the half-voxel line; its height is at least twice
// that line.
std::string depth_strip(const RunSummary& run);
// One line for each asset that was baked or taken from the cache.
std::string assets(const io::LoadedScene& scene);

}  // namespace h6::cli
