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
Scene alphas_in_two_hands();
Scene bridge_and_dinosaur();
Scene clip_and_rod();
Scene engine_bay();
Scene gear_train();
Scene hose_in_bracket();
Scene landing_gear();
Scene nut_on_bolt();
Scene piston_in_bore();
Scene spline_hub_1k();
Scene spline_hub_10k();
Scene spline_hub_100k();
Scene wire_bundle();

}  // namespace h6::io
