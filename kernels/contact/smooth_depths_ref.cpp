// SPDX-License-Identifier: Apache-2.0
// smooth_depths_ref.cpp - the specification of smooth_depths.
#include "kernels/contact/smooth_depths.h"

#include <algorithm>
#include <cmath>

namespace h6::kernels {

void smooth_depths_ref(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                       float voxel, float* depth, float* gx, float* gy, float* gz) {
  for (std::size_t i = 0; i < points.count; ++i) {
    const double here = crosses.at[0][i];
    double error = 0, sharp = 0, tilt[3];
    for (int k = 0; k < 3; ++k) {
      const float* m = to_field.m[k];
      const double place = double{m[0]} * points.x[i] + double{m[1]} * points.y[i] +
                           double{m[2]} * points.z[i] + m[3];
      const double t = place - std::floor(place);
      const double f = double{crosses.at[2 * k + 1][i]} + crosses.at[2 * k + 2][i] - 2 * here;
      error += t * (1 - t) * f / 2;
      tilt[k] = (1 - 2 * t) * f / 2;
      sharp += std::fabs(f);
    }
    const double sure = std::clamp(2 * (crosses.band - 1 - std::fabs(here)), 0.0, 1.0);
    const double part = sharp / kSmoothTo;
    const double even = sure * std::max(0.0, 1 - part * part);
    const double inside = std::clamp(depth[i] / (double{kSmoothFrom} * voxel), 0.0, 1.0);
    depth[i] += static_cast<float>(voxel * even * error * inside);
    double g[3] = {gx[i], gy[i], gz[i]}, length2 = 0;
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis)
        g[k] -= double{crosses.turn[3 * k + axis]} * even * tilt[axis];
      length2 += g[k] * g[k];
    }
    const double scale = 1 / std::sqrt(length2);
    gx[i] = static_cast<float>(scale * g[0]);
    gy[i] = static_cast<float>(scale * g[1]);
    gz[i] = static_cast<float>(scale * g[2]);
  }
}

}  // namespace h6::kernels
