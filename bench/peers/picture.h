// SPDX-License-Identifier: Apache-2.0
// picture.h - the comparison as a drawing: bars of time, one group a task, on a logarithmic axis.
#pragma once
#include <string>
#include <vector>

#include "bench/peers/measure.h"

namespace h6::peers {

std::string svg_of(const std::vector<TaskReport>& tasks);

}  // namespace h6::peers
