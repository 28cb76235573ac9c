// SPDX-License-Identifier: Apache-2.0
// contact_columns_ref.cpp - the specification of contact_columns.
#include <algorithm>
#include <cmath>

#include "kernels/contact/contact_columns.h"

namespace h6::kernels {
namespace {

struct Torque {
  double x, y, z;
};
Torque torque(const ContactColumns& c, std::size_t i) {
  const double n[3] = {c.nx[i], c.ny[i], c.nz[i]}, r[3] = {c.rx[i], c.ry[i], c.rz[i]};
  return {r[1] * n[2] - r[2] * n[1], r[2] * n[0] - r[0] * n[2], r[0] * n[1] - r[1] * n[0]};
}

}  // namespace

void contact_facing_ref(const ContactColumns& c, float edge, float* facing) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const double dot =
        double{c.nx[i]} * c.gx[i] + double{c.ny[i]} * c.gy[i] + double{c.nz[i]} * c.gz[i];
    facing[i] = static_cast<float>(std::clamp(dot / edge, 0.0, 1.0));
  }
}

void push_directions_ref(const ContactColumns& c, const Crosses* crosses, float* nx, float* ny,
                         float* nz, float* facing) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const double N[3] = {c.nx[i], c.ny[i], c.nz[i]};
    double G[3] = {c.gx[i], c.gy[i], c.gz[i]}, lean = 1;
    if (crosses) {
      const Crosses& a = *crosses;
      double d[7], ends = 0;
      for (int k = 0; k < 7; ++k) d[k] = a.at[k][i];
      for (int k = 1; k < 7; ++k) ends += d[k];
      const double step = a.step,
                   slope[3] = {(d[1] - d[2]) / (2 * step), (d[3] - d[4]) / (2 * step),
                               (d[5] - d[6]) / (2 * step)};
      const double curvature = (ends - 6 * d[0]) / (step * step);
      const double sure = std::clamp(2 * (a.band - step - std::fabs(d[0])), 0.0, 1.0);
      for (int k = 0; k < 3; ++k) {
        const double turned = double{a.turn[3 * k]} * slope[0] +
                              double{a.turn[3 * k + 1]} * slope[1] +
                              double{a.turn[3 * k + 2]} * slope[2];
        G[k] += sure * (turned - G[k]);
      }
      const double depth = -d[0] / (2 * step);
      const double deep =
          std::clamp((depth - kLeanFrom) / (double{kLeanFull} - kLeanFrom), 0.0, 1.0);
      const double q = sure * curvature / kSharp;
      lean += (1 - deep) * (lean / (1 + q * q) - lean);
    }
    const double dot = N[0] * G[0] + N[1] * G[1] + N[2] * G[2];
    const double still = kStillFacing + lean * (kStillFacingLeaning - double{kStillFacing});
    const double share = std::clamp(1 - dot / still, 0.0, 1.0);
    lean *= kMostLean;
    if (dot < 0) lean = std::min(lean, (1 - double{kLeastAlong}) / -dot);
    if (share == 0) lean = 0;
    const double to[3] = {N[0] + lean * G[0], N[1] + lean * G[1], N[2] + lean * G[2]};
    const double length = std::sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
    nx[i] = static_cast<float>(to[0] / length);
    ny[i] = static_cast<float>(to[1] / length);
    nz[i] = static_cast<float>(to[2] / length);
    facing[i] = static_cast<float>(share);
  }
}

void firmness_ref(const float* depth, std::size_t count, const Firmness& f, float* present,
                  float* stiffness) {
  for (std::size_t i = 0; i < count; ++i) {
    const float way = std::clamp(depth[i] / f.half_voxel, 0.0f, 1.0f);
    present[i] = std::clamp(std::max(depth[i], present[i]), 0.0f, f.full);
    stiffness[i] = f.shallow + f.rise * way * way;
  }
}

void torque_directions_ref(const ContactColumns& c, float l0, float lever, float* tx, float* ty,
                           float* tz) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const Torque t = torque(c, i);
    const double length =
        lever > 0 ? lever : std::sqrt(t.x * t.x + t.y * t.y + t.z * t.z + double{l0} * l0);
    const double scale = length > 0 ? 1 / length : 0.0;
    tx[i] = static_cast<float>(t.x * scale);
    ty[i] = static_cast<float>(t.y * scale);
    tz[i] = static_cast<float>(t.z * scale);
  }
}

Depths look_at_depths_ref(const float* depth, std::size_t count) {
  Depths out{0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    out.inside += depth[i] > 0;
    out.deepest = depth[i] > out.deepest ? depth[i] : out.deepest;
  }
  return out;
}

void series_gap_ref(const ContactColumns& c, const float* depth, double beta, const double u[6],
                    float* e) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const Torque t = torque(c, i);
    const double approach =
        c.nx[i] * u[0] + c.ny[i] * u[1] + c.nz[i] * u[2] + t.x * u[3] + t.y * u[4] + t.z * u[5];
    e[i] = static_cast<float>(double{depth[i]} - beta * approach);
  }
}

void series_loads_ref(const SeriesLoads& c, float touch) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const float u = c.slack[i];
    if (u < touch) c.kappa[i] *= u / touch;
    c.slack[i] = u - 0.5f * std::min(u, touch);
    c.load[i] = c.kappa[i] * c.slack[i];
    c.weight[i] = c.depth[i] > 0 ? c.load[i] / c.depth[i] : 0.0f;
  }
}

}  // namespace h6::kernels
