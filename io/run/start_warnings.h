// SPDX-License-Identifier: Apache-2.0
// start_warnings.h - what a person should know of a scene before it runs, beside overlaps.
#pragma once
#include <string>
#include <vector>

#include "io/scene/load_scene.h"

namespace h6::cli {

// A sentence for a scene without hands, and for each part that starts far from its hand's path. A
// `device` that is given for every hand replaces those of the scene; "" replaces none.
std::vector<std::string> start_warnings(const io::LoadedScene& loaded, const std::string& device);

}  // namespace h6::cli
