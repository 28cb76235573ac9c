// SPDX-License-Identifier: Apache-2.0
// peg_in_tight_hole.h - a peg that is thicker than its hole, in its designed place.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hapsix/hapsix.h"
#include "tests/support/one_part.h"

namespace h6::test {

inline constexpr double kFitVoxel = 5e-4;      // [m]
inline constexpr double kHoleRadius = 6e-3;    // [m]
inline constexpr double kHoleDepth = 12e-3;    // from the top of the block, z = 0, to the peg's end
inline constexpr double kPegHeadroom = 12e-3;  // of the peg above the block

// The block z < 0 with a hole along z. Its floor is far below the peg.
inline double hole_distance(double x, double y, double z) {
  const double side = kHoleRadius - std::hypot(x, y);
  return z > 0 && side > 0 ? std::hypot(z, side) : std::max(z, side);
}

// Side and lower end of a round peg along z, its origin at the level of the block's top.
inline ShellArrays peg_points(double radius) {
  ShellArrays s;
  for (int i = 0; i < 48; ++i)
    for (int a = 0; a < 72; ++a) {
      const double z = -kHoleDepth + (i + 0.5) / 48 * (kHoleDepth + kPegHeadroom);
      const double t = 2 * M_PI * (a + 0.5 * (i % 2)) / 72, c = std::cos(t), n = std::sin(t);
      s.add(radius * c, radius * n, z, -c, -n, 0);
    }
  for (int ring = 0; ring <= 12; ++ring)
    for (int a = 0; a < std::max(1, 6 * ring); ++a) {
      const double t = 2 * M_PI * a / std::max(1, 6 * ring), r = radius * ring / 12;
      s.add(r * std::cos(t), r * std::sin(t), -kHoleDepth, 0, 0, 1);
    }
  return s;
}

struct PegInTightHole : OnePart {
  explicit PegInTightHole(double overlap_voxels, h6Method method = H6_METHOD_ROBUST)
      : OnePart(sample_analytic(hole_distance, {-16e-3, -16e-3, -20e-3}, kFitVoxel, 8, 8, 9),
                peg_points(kHoleRadius + overlap_voxels * kFitVoxel)) {
    hand.safety.soft_start = 0;
    def.contact.method = method;
  }
  h6DeviceCommand step(const h6Pose& where) {
    const h6DeviceSample sample = hand_at(where);
    h6DeviceCommand command{};
    h6Step(session, &sample, &command);
    return command;
  }
  h6FrameReport report() const { return h6GetFrame(session); }
  h6BodyState body() const { return h6GetBody(session, 1); }
};

}  // namespace h6::test
