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

void series_loads_ref(const float* kappa, const float* slack, const float* depth, std::size_t count,
                      float* load, float* weight) {
  for (std::size_t i = 0; i < count; ++i) {
    load[i] = kappa[i] * slack[i];
    weight[i] = depth[i] > 0 ? load[i] / depth[i] : 0.0f;
  }
}

}  // namespace h6::kernels
