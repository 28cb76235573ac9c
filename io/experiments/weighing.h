// SPDX-License-Identifier: Apache-2.0
// weighing.h - `series` beside `robust`, criterion by criterion, from what was
// measured.
#pragma once
#include "io/experiments/report.h"

namespace h6::cli {

// Rows for whatever of scenes and studies was run; no rows when nothing compares the two.
Study weigh_series(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns,
                   const std::vector<Study>& studies);

}  // namespace h6::cli
