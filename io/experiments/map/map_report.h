// SPDX-License-Identifier: Apache-2.0
// map_report.h - the robustness map as tables, JSON and CSV.
#pragma once
#include "io/experiments/map/figures.h"
#include "io/experiments/report.h"

namespace h6::cli {

struct MapReport {
  const MapOptions& options;
  const std::vector<MapScene>& scenes;

  static std::string about();        // what is run, and what the columns of the tables mean
  TextTable table(int which) const;  // MapTable
  // The tables with what their columns mean, scenes that are left out, variations that do not hold,
  // and the conclusions.
  std::string text(bool as_markdown) const;
  nlohmann::ordered_json json() const;
  std::string csv() const;          // a row for each run
  std::string first_error() const;  // of a variation that could not be made or run; may be empty
};

}  // namespace h6::cli
