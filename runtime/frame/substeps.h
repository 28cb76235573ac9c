// SPDX-License-Identifier: Apache-2.0
// substeps.h - how many steps a frame takes, so that no point jumps over an obstacle. METHOD.md,
// Sec. 8.
#pragma once
#include <cstdint>

#include "hapsix/hapsix.h"

namespace h6 {

// No point near a field moves farther than this in a step [voxel]. So it lands in the front half of
// a sheet of half a voxel, with some room left for the spring. In the rear half the gradient points
// to the far side.
inline constexpr double kLongestStep = 0.2;

// The steps of one frame.
struct Substeps {
  std::uint32_t count = 1;
  double needed = 1;  // more than `count` when the budget ended
};

// Decides from poses, velocities and hands how many steps this frame takes, at most max_substeps.
// Call it when the hands' samples are known.
Substeps plan_substeps(h6Session& s);
// The share of its way at which a hand is in step i. A hand that holds its body directly goes only
// as far as the budget allows.
double share_of_way(const Substeps& plan, bool held, std::uint32_t i);
// Slows all free bodies down, by one factor, until no point near a field would move too far in a
// step of `dt` seconds. Returns whether it did.
bool slow_down(h6Session& s, double dt);

}  // namespace h6
