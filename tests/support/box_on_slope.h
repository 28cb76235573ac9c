// SPDX-License-Identifier: Apache-2.0
// box_on_slope.h - a box with friction on a slope, for tests.
#pragma once
#include <cmath>

#include "tests/support/box_on_floor.h"

namespace h6::test {

inline constexpr double g = 9.81;

// A box on a slope: the floor stays level and gravity leans, downhill along x.
struct BoxOnSlope : BoxOnFloor {
  explicit BoxOnSlope(double mu, double slope) {
    def.hands = nullptr, def.hand_count = 0;
    def.contact.friction = mu;
    lean(slope);
  }
  void lean(double slope) { def.gravity = {g * std::sin(slope), 0, -g * std::cos(slope)}; }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * def.rate); ++i) h6Step(session, nullptr, nullptr);
  }
};

}  // namespace h6::test
