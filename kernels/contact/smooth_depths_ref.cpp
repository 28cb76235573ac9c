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
    double error = 0, sharp = 0, steep2 = 0, slope[3], room = crosses.band - 1 - std::fabs(here);
    for (int k = 0; k < 3; ++k) {
      const float* m = to_field.m[k];
      const double place = double{m[0]} * points.x[i] + double{m[1]} * points.y[i] +
                           double{m[2]} * points.z[i] + m[3];
      const double t = place - std::floor(place);
      const double above = crosses.at[2 * k + 1][i], below = crosses.at[2 * k + 2][i];
      const double f = above + below - 2 * here;
      error += t * (1 - t) * f / 2;
      sharp += std::fabs(f);
      slope[k] = (above - below) / 2;
      steep2 += slope[k] * slope[k];
      room = std::min({room, place - 1, crosses.last[k] - 1 - place});
    }
    const double part = sharp / kSmoothTo;
    const double even = std::clamp(2 * room, 0.0, 1.0) * std::max(0.0, 1 - part * part);
    const double inside = std::clamp(depth[i] / (double{kSmoothFrom} * voxel), 0.0, 1.0);
    depth[i] += static_cast<float>(voxel * even * error * inside);
    const double e = even * std::min(steep2, 1.0);
    double g[3] = {gx[i], gy[i], gz[i]}, length2 = 0;
    for (int k = 0; k < 3; ++k) {
      g[k] *= 1 - e;
      for (int axis = 0; axis < 3; ++axis)
        g[k] += double{crosses.turn[3 * k + axis]} * e * slope[axis];
      length2 += g[k] * g[k];
    }
    const double scale = 1 / std::sqrt(length2);
    gx[i] = static_cast<float>(scale * g[0]);
    gy[i] = static_cast<float>(scale * g[1]);
    gz[i] = static_cast<float>(scale * g[2]);
  }
}

}  // namespace h6::kernels
