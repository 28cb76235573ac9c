// SPDX-License-Identifier: Apache-2.0
// tables.h - runs as a person reads them.
#pragma once
#include <string>
#include <vector>

#include "io/run/run_scene.h"

namespace h6::cli {

// One row a run: method, contacts, deepest point, frame times, late frames by cause, verdict.
std::string table(const std::vector<RunSummary>& runs);
// Late frames by cause and by how late, coarse frames; empty when there were none.
std::string late_table(const RunSummary& run);
// The deepest contact over time, with the half-voxel line: full height is twice that line or more.
std::string depth_strip(const RunSummary& run);
// What was baked or taken from the cache, a line each.
std::string assets(const io::LoadedScene& scene);

}  // namespace h6::cli
