// SPDX-License-Identifier: Apache-2.0
// map_page.h - the robustness map as a page that opens from disk: every run as a mark in a drawing,
// the tables and the conclusions.
#pragma once
#include "io/experiments/map/map_report.h"

namespace h6::cli {

// HTML with its drawings inside; it loads nothing.
std::string map_page(const MapReport& report);

// The drawing of a table (MapTable) alone, as SVG: a row for each scene and method, a column for
// each force, the depth to the right on a logarithmic axis. A run that is not held is a cross, and
// every mark names its run.
std::string map_drawing(const MapReport& report, int table);

}  // namespace h6::cli
