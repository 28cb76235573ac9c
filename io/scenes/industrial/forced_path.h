// SPDX-License-Identifier: Apache-2.0
// forced_path.h - hand paths that force a part against its surroundings.
#pragma once
#include "io/scene/scene.h"

namespace h6::io {

// The clear way of engine-bay's starter and of landing-gear's actuator from outside to 3 mm before
// their seats.
Path starter_way_in();
Path actuator_way_in();

// How far a random pull goes [m], how far it turns [rad], and how fast [m/s].
struct Pulls {
  int count = 5;
  double reach = 0.06, turn = 0.5, speed = 0.1;
};

// The hand follows `way_in` up to somewhere in its last 60 %. From there it pulls and turns the
// part a few times, each time from the same place, whatever is in the way. The same index gives the
// same path on every machine.
Path forced_path(const Path& way_in, std::size_t index, const Pulls& pulls = {});

}  // namespace h6::io
