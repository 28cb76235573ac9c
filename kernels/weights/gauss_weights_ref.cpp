// SPDX-License-Identifier: Apache-2.0
// gauss_weights_ref.cpp - the specification of gauss_weights, in double.
//
// Xu & Barbic 2016, Eq. (6)-(12), with the weight read as phi_self/phi_i: contacts of equal
// direction share one contact's stiffness, as the paper's text says.
#include <algorithm>
#include <cmath>

#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {
namespace {

// Eq. (6): 1 at the same direction, 0 from epsilon on.
double hat(const float* x, const float* y, const float* z, std::size_t i, std::size_t j,
           float epsilon, bool geodesic) {
  const double width = std::max(epsilon, kMinWidth);
  const double dx = double{x[j]} - x[i], dy = double{y[j]} - y[i], dz = double{z[j]} - z[i];
  double gap2 = dx * dx + dy * dy + dz * dz;
  if (geodesic) {
    const double angle = 2 * std::asin(std::min(1.0, 0.5 * std::sqrt(gap2)));
    gap2 = angle * angle;
  }
  return std::max(0.0, 1.0 - gap2 / (width * width));
}

double hat_ij(const DirectionsView& c, Hat kind, const GaussWidths& widths, std::size_t i,
              std::size_t j) {
  const double over_normals = hat(c.nx, c.ny, c.nz, i, j, widths.normal, widths.geodesic);
  if (kind == Hat::normal) return over_normals;
  const double over_torques = hat(c.tx, c.ty, c.tz, i, j, widths.torque, widths.geodesic);
  return kind == Hat::sum ? over_normals + over_torques : over_normals * over_torques;
}

double facing_of(const DirectionsView& c, std::size_t i) { return c.facing ? c.facing[i] : 1.0; }

double share_of(const DirectionsView& c, std::size_t i) {
  return facing_of(c, i) * (c.depth ? c.depth[i] : 1.0);
}

}  // namespace

void gauss_weights_ref(const DirectionsView& c, Hat kind, const GaussWidths& widths,
                       std::size_t begin, std::size_t end, float* weight) {
  for (std::size_t i = begin; i < end; ++i) {
    double density = 0;  // phi_i, Eq. (7), (11)
    for (std::size_t j = 0; j < c.count; ++j)
      density += share_of(c, j) * hat_ij(c, kind, widths, i, j);
    const double self = kind == Hat::sum ? 2.0 : 1.0;
    const double w = share_of(c, i) > 0 ? facing_of(c, i) * share_of(c, i) * self / density : 0.0;
    weight[i] = static_cast<float>(w);
  }
}

}  // namespace h6::kernels
