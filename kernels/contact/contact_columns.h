// SPDX-License-Identifier: Apache-2.0
// contact_columns.h - columns that the weighing rules compute for each contact on its own.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// Inward unit normal N, unit gradient g of the field, arm r from the centre of mass [m].
struct ContactColumns {
  const float *nx, *ny, *nz;
  const float *gx, *gy, *gz;
  const float *rx, *ry, *rz;
  std::size_t count;
};

// facing_i = clamp(N.g / edge, 0, 1). A contact whose normal opposes the gradient would pull the
// body in.
void contact_facing(const ContactColumns& c, float edge, float* facing);
void contact_facing_ref(const ContactColumns& c, float edge, float* facing);

// T = (r x N) / sqrt(|r x N|^2 + l0^2): Xu & Barbic 2016, Eq. (10), with a floor l0 [m]. Without it
// T is rounding noise of length 1 where r is parallel to N. T = 0 where the root is 0. With
// lever > 0, Eq. (13): T = (r x N) / lever [m].
void torque_directions(const ContactColumns& c, float l0, float lever, float* tx, float* ty,
                       float* tz);
void torque_directions_ref(const ContactColumns& c, float l0, float lever, float* tx, float* ty,
                           float* tz);

// The number of depths above 0 and the largest depth, 0 when none is above 0. No NaN.
struct Depths {
  std::size_t inside;
  float deepest;
};
Depths look_at_depths(const float* depth, std::size_t count);
Depths look_at_depths_ref(const float* depth, std::size_t count);

// e_i = depth_i - beta [N; r x N].u, with u the relative velocity (v, omega) and beta [s].
void series_gap(const ContactColumns& c, const float* depth, double beta, const double u[6],
                float* e);
void series_gap_ref(const ContactColumns& c, const float* depth, double beta, const double u[6],
                    float* e);

// load_i = kappa_i slack_i; weight_i = load_i / depth_i, or 0 where the depth is not above 0.
void series_loads(const float* kappa, const float* slack, const float* depth, std::size_t count,
                  float* load, float* weight);
void series_loads_ref(const float* kappa, const float* slack, const float* depth, std::size_t count,
                      float* load, float* weight);

}  // namespace h6::kernels
