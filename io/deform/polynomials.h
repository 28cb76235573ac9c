// SPDX-License-Identifier: Apache-2.0
// polynomials.h - the exact coefficients of the reduced internal force. Private.
//
// At a point of quadrature G(q) = sum_i q_i G_i, so the Green strain is
//   E(q) = sum_i q_i L_i + 1/2 sum_ij q_i q_j Q_ij,  L_i = sym(G_i), Q_ij = sym(G_i^T G_j),
// and the energy density 1/2 E:C:E. Its derivative by q_i is
//   f_i = (L_i + sum_j q_j Q_ij) : C : (sum_k q_k L_k + 1/2 sum_kl q_k q_l Q_kl),
// whose coefficients are products a:C:b of the L and Q. All of them are the Gram matrix B^T B of
// the 6-vectors b = sqrt(weight C) a, stacked over all points: one dense product instead of a loop
// over triples at every point.
#pragma once
#include <Eigen/Core>

#include "io/deform/reduced_model.h"
#include "io/deform/stvk.h"
#include "io/file/pulse.h"

namespace h6::io::deform {

// Fills linear, quadratic and cubic of a model with this basis; false: cancelled.
bool make_polynomials(const SolidMesh& mesh, const Dofs& dofs, const Eigen::MatrixXd& basis,
                      unsigned threads, ReducedModel& model, Pulse& pulse);

}  // namespace h6::io::deform
