// SPDX-License-Identifier: Apache-2.0
// missed_halves_ref.cpp - the specification of missed_halves.
#include <cmath>

#include "kernels/field/missed_halves.h"

namespace h6::kernels {
namespace {

// Along x, then y, then z; the nodes of the corners keep their values.
float interpolated(const float* corners, int cells, const int (&node)[3], int axis,
                   const int (&at)[3]) {
  if (axis < 0) return corners[((at[2] * (cells + 1)) + at[1]) * (cells + 1) + at[0]];
  const int step = 8 / cells, rest = node[axis] % step;
  int low[3] = {at[0], at[1], at[2]}, high[3] = {at[0], at[1], at[2]};
  low[axis] = node[axis] / step;
  high[axis] = low[axis] + 1;
  const float from = interpolated(corners, cells, node, axis - 1, low);
  if (rest == 0) return from;
  const float to = interpolated(corners, cells, node, axis - 1, high);
  return from + float(rest) / float(step) * (to - from);
}

}  // namespace

unsigned missed_halves_ref(const float* corners, std::size_t cells, const float* exact,
                           float allowed, float tested) {
  unsigned halves = 0;
  for (int n = 0; n < int(kMissedBox); ++n) {
    const int node[3] = {n % 9, n / 9 % 9, n / 81};
    const float found = interpolated(corners, int(cells), node, 2, {0, 0, 0});
    if (!(std::fabs(exact[n]) < tested) || std::fabs(exact[n] - found) <= allowed) continue;
    for (unsigned half = 0; half < 8; ++half) {
      bool in = true;
      for (unsigned k = 0; k < 3; ++k) in = in && (half >> k & 1 ? node[k] >= 4 : node[k] <= 4);
      halves |= unsigned(in) << half;
    }
  }
  return halves;
}

}  // namespace h6::kernels
