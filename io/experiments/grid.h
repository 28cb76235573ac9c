// SPDX-License-Identifier: Apache-2.0
// grid.h - what studies that run scenes share: every scene with every column.
#pragma once
#include "io/experiments/studies.h"

namespace h6::cli {

using Loaded = std::unique_ptr<io::LoadedScene>;

// A table's first row: what the rows are, then the columns' names.
TextTable head(const std::string& first, const std::vector<MethodColumn>& columns);

// One after the other; those that fail are left empty.
std::vector<Loaded> load_all(std::vector<io::Scene> scenes);

// Scene s with column m is at [s][m].
using RunGrid = std::vector<std::vector<RunFigures>>;
RunGrid run_grid(const std::vector<Loaded>& scenes, const std::vector<MethodColumn>& columns,
                 const std::string& label, const Console& console);

}  // namespace h6::cli
