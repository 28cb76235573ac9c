// SPDX-License-Identifier: Apache-2.0
// list.h - declares one function for each generated scene; scenes.cpp finds them by name.
#pragma once
#include "io/scene/scene.h"

namespace h6::io {

Scene box_on_wall();
Scene peg_in_hole();
Scene box_on_plates();
Scene box_on_wall_explicit();
Scene box_over_fused_wire();
Scene box_over_post();
Scene box_over_wire();
Scene cone_in_gap();
Scene rod_between_tubes();
Scene alpha_shortcut();
Scene alpha_solution();
Scene engine_bay();
Scene landing_gear();

}  // namespace h6::io
