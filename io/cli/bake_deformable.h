// SPDX-License-Identifier: Apache-2.0
// bake_deformable.h - adds `hapsix bake deformable`.
#pragma once
#include "io/cli/commands.h"

namespace h6::cli {

void add_bake_deformable(CLI::App* bake, Program& program);

}  // namespace h6::cli
