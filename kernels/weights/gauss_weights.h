// SPDX-License-Identifier: Apache-2.0
// gauss_weights.h - each contact's share of stiffness, from the density of contacts around it on
// the Gauss map. Xu & Barbic 2016, Eq. (6)-(12), and our product form.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

enum class Hat {
  normal,   // h(N)            Eq. (6)-(9)
  sum,      // h(N) + h(T)     Eq. (10)-(12) as printed
  product,  // h(N) * h(T)     a metric on S2 x S2
};

// N: inward unit normals. T: torque directions (not read for Hat::normal).
// facing c in [0,1] and depth s >= 0 may be null: all ones.
struct DirectionsView {
  const float *nx, *ny, *nz;
  const float *tx, *ty, *tz;
  const float* facing;
  const float* depth;
  std::size_t count;
};

inline constexpr float kMinWidth = 1e-4f;
struct GaussWidths {
  float normal;           // epsilon over N, > 0
  float torque;           // epsilon over T, > 0
  bool geodesic = false;  // the angle 2 asin(|V_j - V_i|/2) takes the chord's place
};

// For i in begin..end-1, against all j in 0..count-1:
//     h(V)_ij = max(0, 1 - |V_j - V_i|^2 / epsilon^2)          differences, never 2 - 2 V_i.V_j
//                                                              (or the angle: GaussWidths)
//     s_j     = facing_j * depth_j
//     phi_i   = sum_j s_j * hat_ij
//     w_i     = facing_i * s_i * hat_self / phi_i               hat_self = 1, 2 (sum), 1
//     w_i     = 0 where s_i = 0
// Widths below kMinWidth count as kMinWidth: unit normals in float resolve little less. `weight` is
// indexed by i and must not alias the view. This is the specification, O(count) a row; what a frame
// runs is gauss_few.h for few contacts, gauss_sweep.h for some thousand and gauss_tree.h for more,
// or where they are crowded. The last is less exact from kGaussMany contacts on.
void gauss_weights_ref(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                       std::size_t begin, std::size_t end, float* weight);

}  // namespace h6::kernels
