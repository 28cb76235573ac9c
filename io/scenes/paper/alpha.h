// SPDX-License-Identifier: Apache-2.0
// alpha.h - shared parts of the scenes with two alphas.
#pragma once
#include <string>

#include "io/scene/scene.h"

namespace h6::io {

// One fixed alpha with the paper's field, and one with the paper's shell, the tool, held at `tool`
// with 20 N at most. Without a hand and without a verdict.
Scene alpha_pair(const std::string& name, const std::string& about, const h6Pose& tool);

// The lower strand's direction in the xy view where the strands cross: out of the loop.
h6Vec3 alpha_outward();
// The tip of the loop, mesh frame: the middle of a straight piece of tube, a little inside of the
// curve.
h6Vec3 alpha_tip();

}  // namespace h6::io
