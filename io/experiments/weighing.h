// SPDX-License-Identifier: Apache-2.0
// weighing.h - compares `series` with `robust` by every measured figure.
#pragma once
#include "io/experiments/report.h"

namespace h6::cli {

// Has rows for the scenes and studies that were run, and none when nothing compares the two
// methods.
Study weigh_series(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns,
                   const std::vector<Study>& studies);

}  // namespace h6::cli
