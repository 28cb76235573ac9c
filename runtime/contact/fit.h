// SPDX-License-Identifier: Apache-2.0
// fit.h - the relief of a pair's points: by how much each may be inside before it pushes.
//
// Parts in their designed place overlap. Under `relieve` the depth that a point has at the start is
// its zero, until the point has once been free. METHOD.md, Sec. 7.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/contact/touch_groups.h"

namespace h6 {

// The points that still have relief. Rows of the shell, ascending.
struct PairFit {
  std::uint32_t* row = nullptr;
  float* relief = nullptr;  // [voxel]
  std::size_t count = 0;
  float deepest = 0;  // true depth of the deepest candidate in the last traversal [voxel]
};

// The contact settings that hold for every point of a pair.
struct FitRule {
  float offset;  // added to every distance [voxel]
  float margin;  // points nearer than this take part [voxel]
};

// Replaces the distances of `count` candidates by distance + offset + relief, and keeps, in their
// order, those below the margin. Returns how many it keeps. `complete`: the candidates are all
// points below the margin, in ascending order; then points that take no part even without relief
// are free, and lose it for good.
std::size_t relieve(PairFit& fit, const kernels::Touching& candidates, std::size_t count,
                    const FitRule& rule, bool complete);

}  // namespace h6
