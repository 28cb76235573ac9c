// SPDX-License-Identifier: Apache-2.0
// alpha.h - shared parts of the scenes with two alphas.
#pragma once
#include <string>

#include "io/scene/scene.h"

namespace h6::io {

// A fixed alpha with the paper's field, and the tool: an alpha with the paper's shell, at pose
// `tool`, with a coupling of 20 N at most. The caller adds the hand and the verdict.
Scene alpha_pair(const std::string& name, const std::string& about, const h6Pose& tool);

// Unit vector in the xy plane along the lower strand at the crossing, pointing out of the loop.
h6Vec3 alpha_outward();
// The tip of the loop in the mesh frame: the middle of the straight piece of tube there. It lies a
// little inside the curve, because that piece is a chord of it.
h6Vec3 alpha_tip();

}  // namespace h6::io
