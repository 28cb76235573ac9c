// SPDX-License-Identifier: Apache-2.0
// stvk.h - the full finite element model: mass, internal force and stiffness. Private.
//
// St. Venant-Kirchhoff: with the displacement gradient G = du/dX the Green strain is
// E = (G + G^T + G^T G) / 2, the second Piola-Kirchhoff stress S = lambda tr(E) I + 2 mu E, and
// corner a feels the force -f_a with f_a = integral of (I + G) S dN_a/dX. Vectors hold the free
// degrees of freedom only: 3 a vertex, without fixed vertices and those of no element.
#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "io/deform/elements.h"
#include "io/deform/solid_mesh.h"

namespace h6::io::deform {

using Sparse = Eigen::SparseMatrix<double>;  // symmetric: the lower half only

struct Dofs {
  std::vector<std::int32_t> first;  // (vertices) place of the vertex's x; y and z follow; -1: fixed
  Eigen::Index count = 0;
};
Dofs free_dofs(const SolidMesh& mesh);

struct Lame {
  double lambda, mu;  // [Pa]
};
Lame lame(const SolidMaterial& material);

// Green strain and stress at a displacement gradient.
Eigen::Matrix3d green_strain(const Eigen::Matrix3d& g);
Eigen::Matrix3d stress(const Lame& c, const Eigen::Matrix3d& strain);

// Displacements of an element's corners, one a row, and the gradient that they make at a point.
using Corners = Eigen::Matrix<double, 8, 3>;
Corners corners_of(const SolidElement& element, const Dofs& dofs,
                   const Eigen::Ref<const Eigen::VectorXd>& u);
Eigen::Matrix3d gradient_of(const SolidElement& element, const QuadraturePoint& at,
                            const Corners& u);
// Adds integral weight * p dN_a/dX to the corners' degrees of freedom.
void add_force(const SolidElement& element, const QuadraturePoint& at, const Eigen::Matrix3d& p,
               const Dofs& dofs, Eigen::Ref<Eigen::VectorXd> force);

// Consistent mass [kg]. A lumped one would save nothing, since mass is only multiplied with, and
// its frequencies are worse on coarse meshes.
Sparse mass_matrix(const SolidMesh& mesh, const Dofs& dofs);
// f(u) [N] resists: in balance it equals the external force.
Eigen::VectorXd internal_force(const SolidMesh& mesh, const Dofs& dofs, const Eigen::VectorXd& u);
// df/du [N/m].
Sparse tangent_stiffness(const SolidMesh& mesh, const Dofs& dofs, const Eigen::VectorXd& u);
// d2f / (ds dt) of f(s a + t b) at s = t = 0, for all pairs a <= b of the columns of `modes` in
// lexicographic order (unit of the modes squared, N/m^2).
Eigen::MatrixXd pair_forces(const SolidMesh& mesh, const Dofs& dofs, const Eigen::MatrixXd& modes);

}  // namespace h6::io::deform
