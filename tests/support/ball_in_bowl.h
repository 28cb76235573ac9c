// SPDX-License-Identifier: Apache-2.0
// ball_in_bowl.h - many contacts in all directions: a frame with work for every stage.
#pragma once
#include <cmath>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "tests/support/one_part.h"

namespace h6::test {

inline constexpr double kMm = 1e-3;

// A ball pressed into a conforming bowl. It has hundreds of contacts in all directions and rolls.
struct BallInBowl : OnePart {
  explicit BallInBowl(unsigned threads, int points = 30000)
      : OnePart(
            sample_analytic([](double x, double y,
                               double z) { return 20.2 * kMm - std::sqrt(x * x + y * y + z * z); },
                            {-32 * kMm, -32 * kMm, -32 * kMm}, kMm, 8, 8, 8),
            sphere_points(20 * kMm, points)) {
    hand.coupling.max_depth_voxels = 3;  // pressed hard: many contacts
    def.threads = threads;
  }
  // The hand leans on the wall from the first frame on. The sample has values for every device
  // mode.
  h6DeviceSample sample(int i) const {
    const double a = 0.2 * std::sin(0.01 * i), x = std::sin(1.2 + 0.02 * i);
    h6DeviceSample s =
        hand_at(pose(2 * kMm * x, 1.5 * kMm * std::cos(0.013 * i), 1 * kMm * std::sin(0.05 * i)));
    s.pose.q = {std::cos(a), 0, std::sin(a), 0};
    s.wrench.force = {20 * x, 10 * std::cos(0.013 * i), 5 * std::sin(0.05 * i)};
    s.wrench.torque = {0.01, 0.02 * x, 0};
    s.buttons = static_cast<std::uint32_t>(i / 20 % 2);
    return s;
  }
};

}  // namespace h6::test
