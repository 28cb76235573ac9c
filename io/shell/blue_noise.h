// SPDX-License-Identifier: Apache-2.0
// blue_noise.h - chooses a given number of points that keep their distance from one another.
//
// Greedy ("dart throwing") selection with a shrinking radius: a round at radius r accepts points
// that have no accepted point nearer than r. If fewer than the wanted number fit, r shrinks and the
// next round fills the gaps. So every pair is at least the last r apart, every point that was not
// chosen has a chosen one within the last r but one, and the number is met exactly.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/file/pulse.h"

namespace h6::io {

struct OrientedPoint {
  float p[3];  // [m]
  float n[3];  // unit
};

struct Thinning {
  std::size_t target = 0;     // how many to choose; all if there are no more
  double first_radius = 0;    // > 0 [m]; a poor guess costs time, not quality
  bool fixed_radius = false;  // one round at first_radius, for as many points as fit
  bool both_sides = false;    // points whose normals differ by more than 134 degrees, as on the two
                              // faces of a thin plate, keep only 0.75 of the radius
  // > 0, with a fixed radius: chosen points leave room for those that stand out beyond them by more
  // than this along their own normals [m], and for those of the other side of a thin part.
  double tolerance = 0;
  std::size_t kept = 0;  // with a fixed radius: the first so many points are chosen already
  std::uint64_t seed = 1;
  unsigned threads = 0;    // 0: all; the choice is the same for any number
  Pulse* pulse = nullptr;  // hears the share that is chosen; may be null
};

struct Thinned {
  std::vector<std::uint32_t> chosen;  // ascending
  double spacing = 0;                 // no two chosen points that exclude each other are nearer [m]
  bool cancelled = false;
};

Thinned thin_out(std::span<const OrientedPoint> points, const Thinning& options);

}  // namespace h6::io
