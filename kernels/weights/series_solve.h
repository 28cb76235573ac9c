// SPDX-License-Identifier: Apache-2.0
// series_solve.h - the load of every contact when the whole penalty stands in series with one
// 6-D spring of stiffness c k: net stiffness never exceeds c k, however dense the sampling.
//
// Lengths in metres, forces in units of k (k times a load is a force). With
//     J_i = [N_i; (r_i x N_i)/L],  a_i = min(|J_i|^2, 2),  kappa_i = facing_i / (1 - a_i/c),  c > 2
// the spring's extension y (m, scaled like J) is
//     y = argmin  c/2 |y|^2 + sum_i kappa_i P(e_i - J_i.y),   P' = p,        convex, C1 (C2: w > 0)
//     p(u) = 0 for u <= 0,  u^2/(2 w) for u <= w,  u - w/2 beyond
// and the loads are lambda_i = kappa_i p(e_i - J_i.y) >= 0, with sum_i lambda_i J_i = c y. With
// w = 0 this is max(0, u). With w > 0 no stiffness jumps where a contact begins to carry load, and
// the wrench is C1. With this kappa a lone contact carries e - w/2 where its slack is above w.
// Newton's method runs from the given y and halves a step while the sum rises:
//     A = c I + sum kappa p' J J^T,   dy = A^-1 (sum kappa p J - c y)
// Residual: |gradient| / (c max e), which bounds the error of y (and of the wrench c y) relative to
// the largest e. METHOD.md, Sec. 3; ours.
#pragma once
#include "kernels/slices.h"
#include "kernels/views.h"

namespace h6::kernels {

template <class T>
struct SeriesColumnsT {
  const T *nx, *ny, *nz;  // inward unit normal
  const T *rx, *ry, *rz;  // arm from the centre of mass                                     [m]
  const T* e;             // -d minus the damping term; below 0 for contacts about to touch  [m]
  const T* facing;        // 0..1, or null: all 1
  std::size_t count;
};
using SeriesColumns = SeriesColumnsT<float>;

struct SeriesParameters {
  double c;      // the dial, > 2
  double lever;  // L > 0 [m]; at least the largest |r|, or a lone contact far out yields more
  double tolerance = 1e-6;
  int iterations = 12;  // Newton steps at most
  double touch = 0;     // w: the slack over which a contact's stiffness grows to its whole [m]
};

struct SeriesResult {
  int iterations;   // Newton steps taken
  double residual;  // at the returned y; 0 when no contact is active
};

// y: the start, and then the solution. kappa, slack (count): kappa_i and max(0, e_i - J_i.y), from
// which series_loads (contact_columns.h) makes loads and stiffness. slack may be the column e, at
// the cost of a pass. A start that is not finite counts as 0. The sums over slices of contacts are
// added in order, so any threads give the same bits.
SeriesResult series_solve(const SeriesColumns& contacts, const SeriesParameters& parameters,
                          double y[6], float* kappa, float* slack,
                          const SliceRunner& run_slices = {});
// The specification, for float and (gradient tests) double columns.
template <class T>
SeriesResult series_solve_ref(const SeriesColumnsT<T>& contacts, const SeriesParameters& parameters,
                              double y[6], T* kappa, T* slack);

}  // namespace h6::kernels
