// SPDX-License-Identifier: Apache-2.0
// basis.h - linear modes, modal derivatives and the basis that they span. Private.
#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCholesky>

#include "hapsix/result.h"
#include "io/deform/stvk.h"
#include "io/file/pulse.h"

namespace h6::io::deform {

// K - shift M, factored once for the modes and their derivatives.
struct Pencil {
  Sparse mass, stiffness;
  double shift = 0;  // [1/s^2] 0, or below where the model is free and K singular
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower> factor;
};
Outcome factorize(const SolidMesh& mesh, const Dofs& dofs, bool free, Pencil& pencil);

// Mass-orthonormal modes of lowest frequency, one a column.
struct LinearModes {
  Eigen::VectorXd eigenvalue;  // omega^2 [1/s^2], rising
  Eigen::MatrixXd shape;
  Eigen::MatrixXd rigid;  // the six rigid ones of a free model, apart; else no column
};
Result<LinearModes> linear_modes(const Pencil& pencil, Eigen::Index count, bool free, Pulse& pulse);

// For all pairs i <= j in lexicographic order: K Phi_ij = - d2f / (dq_i dq_j), how the shape of
// mode i changes as mode j is deflected (Barbic & James 2005, Eq. 12). Those of a free model are
// cleared of rigid motion.
Eigen::MatrixXd modal_derivatives(const SolidMesh& mesh, const Dofs& dofs, const Pencil& pencil,
                                  const LinearModes& modes, Pulse& pulse);

// `directions` columns, orthonormal in the mass matrix: the principal components of the modes and
// derivatives, each scaled to what it adds to the shape under a load that deflects mode 1 by
// `amplitude`, and turned so that the stiffness is diagonal and rises. Fails where they span less.
struct Basis {
  Eigen::MatrixXd shape;
  Eigen::VectorXd eigenvalue;
  double captured = 0;
};
Result<Basis> principal_basis(const Pencil& pencil, const LinearModes& modes,
                              const Eigen::MatrixXd& derivatives, double amplitude,
                              Eigen::Index directions, Pulse& pulse);

}  // namespace h6::io::deform
