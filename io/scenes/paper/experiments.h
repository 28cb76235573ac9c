// SPDX-License-Identifier: Apache-2.0
// experiments.h - the paper's experiments as scenes, each with the values that studies vary.
//
// The overloads without arguments (list.h) have the values of the paper's figures. Where the body
// and the hand of a figure start at different poses, the hand here starts at the body and moves to
// its own start first, so that no run begins with a jump of the force.
#pragma once
#include "io/scenes/paper/experiment_shapes.h"

namespace h6::io {

Scene cone_in_gap(const Sampling& sampling);    // Fig. 3
Scene peg_in_hole(const Sampling& sampling);    // Fig. 10
Scene box_over_wire(const Sampling& sampling);  // Fig. 12
Scene box_over_fused_wire(const Sampling& sampling);
Scene box_over_post(const Sampling& sampling);         // Fig. 12, the wire upright
Scene rod_between_tubes(const Sampling& sampling);     // Fig. 8
Scene box_on_plates(const Sampling& sampling);         // Fig. 7
Scene box_on_wall(const Sampling& sampling);           // cf. Fig. 2
Scene box_on_wall_explicit(const Sampling& sampling);  // Fig. 2
// With nu x nv points on the box's bottom; the figure has 13 x 14.
Scene box_on_wall_explicit(int nu, int nv, const Sampling& sampling = {});

// Fig. 7 with a second plate that is as wide as the first or narrower. `share` is the number of its
// contact points over that of the first plate, 1 or less.
Scene box_on_plates_share(double share);

// Fig. 8: alpha-shortcut for hands that push in other directions and turn at the narrow place.
// alpha_push gives the hand's path of push 0, 1, ...; the same index gives the same path on every
// machine.
Scene alpha_pushes();
Path alpha_push(int index);

}  // namespace h6::io
