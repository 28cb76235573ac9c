// SPDX-License-Identifier: Apache-2.0
// friction_rows.h - the friction of contacts that share one spring. METHOD.md, Sec. 9.
//
// A displacement q = (d, theta) stretches a row by z = P (d + theta x r). In its plane
// P = I - n n^T; along a line P = n n^T, and only where n.(d + theta x r) > 0. Rows with load 0
// have no say.
#pragma once
#include "kernels/contact/contact_columns.h"

namespace h6::kernels {

template <class T>
struct FrictionRowsT {
  const T *nx, *ny, *nz;  // direction of the push or of the line; a unit vector of floats will do
  const T *rx, *ry, *rz;  // arm from the centre of mass                          [m]
  const T* load;          // >= 0: most friction over k                           [m]
  std::size_t count;
  bool lines;
};
using FrictionRows = FrictionRowsT<float>;

// The lines along which pushes rub: depth grows along e, while the push n does no work. METHOD.md,
// Sec. 3, "Friction of a push that leans". A push does not rub where it leans by less than kNoLean,
// since thousands of contacts on a flat wall lean so little.
//   t    = |n x g| / max(|n x g| / kMostRub, n.g)
//   load = t clamp(t / kNoLean - 1, 0, 1) max(pressed, 0)
//   e    = (n (n.g) - g) / |n x g|, or 0 where the load is 0
// pressed: the contacts' normal forces over k [m]. Every contact that has a load becomes a row, in
// order; some without load may stand between them.
inline constexpr float kNoLean = 0.005f, kMostRub = 1.0f;
struct PushLines {
  float *ex, *ey, *ez, *rx, *ry, *rz, *load;  // (c.count)
};
struct PushLineRows {
  std::size_t count;
  double total;  // sum of the loads [m]
};
PushLineRows push_lines(const ContactColumns& c, const float* pressed, const PushLines& out);
PushLineRows push_lines_ref(const ContactColumns& c, const float* pressed, const PushLines& out);

// |z| of each row for the displacement q [m]. A row without load may get any value from 0 on.
void friction_stretch(const FrictionRows& rows, const double q[6], double* stretch);
template <class T>
void friction_stretch_ref(const FrictionRowsT<T>& rows, const double q[6], double* stretch);

// Sums over rows with the stretch z = share * stretch and c = min(z, limit).
struct FrictionSums {
  double stretched;  // load, of rows with z > 0             [m]
  double linear;     // load z                               [m^2]
  double capped;     // load c                               [m^2]
  double sticking;   // load z, of rows with z < limit       [m^2]
  double energy;     // load c (z - c / 2)                   [m^3]
  bool slips;        // a row has z > limit
};
FrictionSums friction_sums(const float* load, const double* stretch, std::size_t count,
                           double share, double limit);
FrictionSums friction_sums_ref(const float* load, const double* stretch, std::size_t count,
                               double share, double limit);

// Adds sum s J^T P J, J = [I, -[r]x], to K, row-major and symmetric. s = scale load / max(limit,
// |z|) with the larger |z| of the displacements q and `ahead`. A line that q does not stretch,
// because it is on its way back, is left out.
struct FrictionSecant {
  double scale, limit;  // [N/m], [m]
};
void friction_stiffness(const FrictionRows& rows, const FrictionSecant& secant, const double q[6],
                        const double ahead[6], double K[36]);
template <class T>
void friction_stiffness_ref(const FrictionRowsT<T>& rows, const FrictionSecant& secant,
                            const double q[6], const double ahead[6], double K[36]);

}  // namespace h6::kernels
