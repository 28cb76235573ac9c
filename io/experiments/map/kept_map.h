// SPDX-License-Identifier: Apache-2.0
// kept_map.h - the finished variations of a map in a folder, each from the moment at which it ends,
// so that the same command goes on after a kill.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "io/experiments/map/map.h"
#include "io/study/table.h"

namespace h6::cli {

// Before open() it keeps nothing, and its functions succeed.
class KeptMap {
 public:
  // Makes the folder, or takes what it has into the plan. Fails when it holds other work than these
  // words of the command ask for, or when another process writes to it.
  Outcome open(const std::string& folder, const std::vector<std::string>& words, MapPlan& plan);
  std::size_t done() const { return table_ ? table_->done() : 0; }
  Outcome add(const MapPlan& plan, std::size_t job, double seconds);
  // Writes runs.csv when every variation has its row.
  Outcome finish();

 private:
  std::optional<study::Table> table_;
};

}  // namespace h6::cli
