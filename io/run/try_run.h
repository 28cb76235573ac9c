// SPDX-License-Identifier: Apache-2.0
// try_run.h - runs a scene in virtual time and keeps nothing but its figures.
#pragma once
#include <optional>

#include "io/run/run_tally.h"

namespace h6::cli {

struct Trial {
  RunTotals totals;
  std::optional<double> first_contact;  // [s]
  double seconds = 0;                   // of virtual time
};
// Fails as RunSetup::open does.
Result<Trial> try_run(const io::LoadedScene& loaded);

}  // namespace h6::cli
