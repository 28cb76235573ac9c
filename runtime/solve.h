// solve.h - the dense system of a step: symmetric positive by LDL^T, anything else by pivoted LU.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "runtime/math.h"

namespace h6 {

// A x = b. False when A is not what `form` promises, or the answer is not finite.
template <int N>
bool solve_system(h6Gradient form, const Eigen::Matrix<double, N, N>& A,
                  const Eigen::Matrix<double, N, 1>& b, Eigen::Matrix<double, N, 1>& x) {
  if (form == H6_EXACT) {
    x = A.partialPivLu().solve(b);
  } else {
    const Eigen::LDLT<Eigen::Matrix<double, N, N>> factors(A);
    if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
    x = factors.solve(b);
  }
  return x.allFinite();
}

// For a body that never turns: its rotation is no unknown.
template <int N>
void hold_rotation(Eigen::Matrix<double, N, N>& A, Eigen::Matrix<double, N, 1>& b, int body) {
  const int first = 6 * body + 3;
  A.template middleRows<3>(first).setZero();
  A.template middleCols<3>(first).setZero();
  A.template block<3, 3>(first, first).setIdentity();
  b.template segment<3>(first).setZero();
}

}  // namespace h6
