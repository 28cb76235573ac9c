// SPDX-License-Identifier: Apache-2.0
// reduced_model.h - a deformable solid whose shape is a sum of r modes, with its internal force.
//
// u = U q, with the modes U orthonormal in the mass matrix, so that q'' + D q' + f(q) = U^T f_ext.
// f is that of St. Venant-Kirchhoff, a cubic polynomial of q:
//   f_i(q) = sum_j P1[i][j] q_j + sum_{j<=k} P2[i][jk] q_j q_k + sum_{j<=k<=l} P3[i][jkl] q_j q_k
//   q_l.
// J. Barbic, D. James, "Real-time subspace integration for St. Venant-Kirchhoff deformable models",
// 2005.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "hapsix/vector.h"
#include "io/deform/solid_mesh.h"

namespace h6::io {

// Pairs j <= k and triples j <= k <= l of r indices, and their places in lexicographic order.
inline constexpr std::size_t pair_count(std::size_t r) { return r * (r + 1) / 2; }
inline constexpr std::size_t triple_count(std::size_t r) { return r * (r + 1) * (r + 2) / 6; }
inline constexpr std::size_t pair_place(std::size_t r, std::size_t j, std::size_t k) {
  return j * r - j * (j + 1) / 2 + k;
}
inline constexpr std::size_t triple_place(std::size_t r, std::size_t j, std::size_t k,
                                          std::size_t l) {
  return triple_count(r) - triple_count(r - j) + pair_place(r - j, k - j, l - j);
}

struct ReducedModel {
  SolidMesh mesh;
  std::size_t modes = 0;  // r, 1 .. kMostModes
  // (vertices x r x 3) displacement of a vertex per unit of q_j, in the mesh's frame [1/sqrt(kg)].
  std::vector<double> basis;
  // (vertices x r x 3) turn of a vertex per unit of q_j, half the curl of the displacement in the
  // elements around it [rad/(m sqrt(kg))]. With them displacements are warped (Choi & Ko 2005), and
  // quadratic and cubic are empty; without them it is empty.
  std::vector<double> turn;
  // Rows i = 0 .. r-1, each contiguous: r, pair_count(r) and triple_count(r) wide. SI units, with q
  // in m sqrt(kg).
  std::vector<double> linear, quadratic, cubic;
  std::vector<double> frequency;  // (r) of small vibrations along each mode [Hz], rising
  // Rayleigh damping D = mass_damping I + stiffness_damping df/dq(0) [1/s], [s].
  double mass_damping = 0, stiffness_damping = 0;
  bool free = false;       // nothing is fixed: the modes are those without the six rigid ones
  std::string input_hash;  // of the mesh, materials, fixed vertices and options
  std::string made_with;   // JSON: the options and the program's version
};

inline constexpr std::size_t kMostModes = 60;

// f(q), r values [N/sqrt(kg)].
void reduced_force(const ReducedModel& model, const double* q, double* force);
// df/dq, r x r, row by row [1/s^2].
void reduced_stiffness(const ReducedModel& model, const double* q, double* stiffness);

// Modes at points of the mesh's frame [m]: (points x r x 3). A point takes the shape functions of
// the element that holds it; outside it follows the nearest element's displacement and gradient at
// the element's nearest point, so that rigid motion stays exact. `farthest`, unless null: how far
// outside a point lies [m].
std::vector<double> modes_at(const ReducedModel& model, const std::vector<h6Vec3>& points,
                             double* farthest = nullptr);

// The same for turns, of a model that has them.
std::vector<double> turns_at(const ReducedModel& model, const std::vector<h6Vec3>& points);
// ReducedModel::turn of a basis (vertices x r x 3): of the elements around a vertex the mean,
// weighted by their volumes.
std::vector<double> vertex_turns(const SolidMesh& mesh, const std::vector<double>& basis,
                                 std::size_t modes);

// Whether sizes and indices fit each other and every number is finite. Files hold such models only.
bool consistent(const ReducedModel& model);

}  // namespace h6::io
