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

// Distances [voxel] at contacts and at the ends of a cross about each: the contact, + x, - x, + y,
// - y, + z, - z along the field's axes. smooth_depths reads `last`, push_directions `step`.
struct Crosses {
  const float* at[7];
  float band;      // farther from the surface than this a distance may be a bound [voxel]
  float last[3];   // the last node of the grid on each axis; places lie from 0 to it
  float turn[9];   // field axes to the axes of normals and gradients, row-major
  float step = 1;  // from the contact to an end [voxel]
};
inline constexpr float kMostLean = 3;  // of the direction towards the gradient
inline constexpr float kSharp = 0.5f;  // curvature of the field that halves it [1/voxel]
// Half a voxel deep a contact leans in full, however sharp the field is: a lone point at an edge
// must get out along the slope. Depths in the field's finest spacing.
inline constexpr float kLeanFrom = 0.25f, kLeanFull = 0.5f;
// N.G at which a contact stops pushing, without a lean and with the most. A point at an edge of the
// part has the normal of one face only, and an obstacle can touch a sharp edge from behind it. On a
// sharp field the limit is narrow, so that a wire lets go of a point that has passed it.
inline constexpr float kStillFacing = -0.25f, kStillFacingLeaning = -0.75f;
inline constexpr float kLeastAlong = 0.1f;  // of the direction along N, before it is made unit

// The direction in which a contact pushes, and its facing factor. METHOD.md, Sec. 3, "Firm".
// Crosses have steps of half the field's finest spacing.
//   G   the slope over the cross, which does not jump between cells; g where `crosses` is null or
//       distances may be bounds
//   q   the curvature of the field, div G, over kSharp; 0 where `crosses` is null
//   s   clamp((depth - kLeanFrom) / (kLeanFull - kLeanFrom), 0, 1)
//   lean      = s + (1 - s) / (1 + q^2)
//   facing    = clamp(1 - N.G / (kStillFacing + lean (kStillFacingLeaning - kStillFacing)), 0, 1)
//   direction = N + min(kMostLean lean, (1 - kLeastAlong) / max(0, -N.G)) G made unit; N where
//               facing is 0
// The direction may be written over N.
void push_directions(const ContactColumns& c, const Crosses* crosses, float* nx, float* ny,
                     float* nz, float* facing);
void push_directions_ref(const ContactColumns& c, const Crosses* crosses, float* nx, float* ny,
                         float* nz, float* facing);

// How much each contact counts in the density, and the stiffness rho of its direction. METHOD.md,
// Sec. 3, "Firm".
//   present   = clamp(max(depth, present), 0, full)                    [m]
//   stiffness = shallow + rise clamp(depth / half_voxel, 0, 1)^2
struct Firmness {
  float full, half_voxel;  // [m]
  float shallow, rise;
};
void firmness(const float* depth, std::size_t count, const Firmness& f, float* present,
              float* stiffness);
void firmness_ref(const float* depth, std::size_t count, const Firmness& f, float* present,
                  float* stiffness);

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

// What series_solve leaves becomes loads (kernels/weights/series_solve.h; w is touch [m]). Below w,
// kappa is multiplied by slack/w and slack is halved; from w on, slack loses w/2. So kappa is then
// the stiffness at the solution, and load = kappa slack. Where touch is 0 both stay. weight = load
// / depth, or 0 where the depth is not above 0.
struct SeriesLoads {
  float *kappa, *slack;
  const float* depth;
  float *load, *weight;
  std::size_t count;
};
void series_loads(const SeriesLoads& c, float touch);
void series_loads_ref(const SeriesLoads& c, float touch);

}  // namespace h6::kernels
