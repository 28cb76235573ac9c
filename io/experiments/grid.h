// SPDX-License-Identifier: Apache-2.0
// grid.h - runs every scene with every column, for the studies that need such a table.
#pragma once
#include "io/experiments/studies.h"

namespace h6::cli {

using Loaded = std::unique_ptr<io::LoadedScene>;

// A table with its head only: `first` names the rows, the other cells name the columns.
TextTable head(const std::string& first, const std::vector<MethodColumn>& columns);

// Loads the scenes in order; a scene that fails is null.
std::vector<Loaded> load_all(std::vector<io::Scene> scenes);

// The run of scene s with column m is at [s][m].
using RunGrid = std::vector<std::vector<RunFigures>>;
RunGrid run_grid(const std::vector<Loaded>& scenes, const std::vector<MethodColumn>& columns,
                 const std::string& label, const Console& console);

}  // namespace h6::cli
