// SPDX-License-Identifier: Apache-2.0
// experiments.h - the paper's experiments as scenes, each with the values that studies vary.
//
// Without arguments they are the figures' own. Where a figure's start is not its hand's, the hand
// here starts at the body and moves there first, so that no run begins with a blow.
#pragma once
#include "io/scenes/paper/experiment_shapes.h"

namespace h6::io {

Scene cone_in_gap(const Sampling& sampling);    // Fig. 3
Scene peg_in_hole(const Sampling& sampling);    // Fig. 10
Scene box_over_wire(const Sampling& sampling);  // Fig. 12
Scene box_over_fused_wire(const Sampling& sampling);
Scene box_over_post(const Sampling& sampling);      // Fig. 12, the wire upright
Scene rod_between_tubes(const Sampling& sampling);  // Fig. 8
Scene box_on_plates(const Sampling& sampling);      // Fig. 7
Scene box_on_wall_explicit(int nu, int nv);         // Fig. 2: nu x nv points on the box's bottom

// Fig. 7, two equal plates of which the second is ever narrower: its share of the first one's
// contact points, 1 or less.
Scene box_on_plates_share(double share);

// Fig. 8: alpha-shortcut for hands that push in other directions, and turn, where it is narrow.
// Push 0, 1, ...: a path of the tool's hand; the same index is the same push anywhere.
Scene alpha_pushes();
Path alpha_push(int index);

}  // namespace h6::io
