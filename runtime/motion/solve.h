// SPDX-License-Identifier: Apache-2.0
// solve.h - the dense system of a step: symmetric positive by LDL^T, anything else by pivoted LU.
#pragma once
#include "runtime/base/math.h"

namespace h6 {

inline constexpr int kIslandBodies = 4;  // bodies that are solved as one system

// The system of an island of bodies: size known at run time, storage fixed.
using IslandMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                   6 * kIslandBodies, 6 * kIslandBodies>;
using IslandVector =
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6 * kIslandBodies, 1>;

// Solves A x = b. Returns false if `form` is symmetric and A is not positive, or if x is not
// finite.
bool solve_system(h6Gradient form, const Mat6& A, const Vec6& b, Vec6& x);
bool solve_system(h6Gradient form, const IslandMatrix& A, const IslandVector& b, IslandVector& x);

// Removes from the system the rotation of a body that never turns.
template <class Matrix, class Vector>
void hold_rotation(Matrix& A, Vector& b, int body) {
  const int first = 6 * body + 3;
  A.template middleRows<3>(first).setZero();
  A.template middleCols<3>(first).setZero();
  A.template block<3, 3>(first, first).setIdentity();
  b.template segment<3>(first).setZero();
}

}  // namespace h6
