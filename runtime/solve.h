// solve.h - the dense system of a step: symmetric positive by LDL^T, anything else by pivoted LU.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "runtime/math.h"

namespace h6 {

// A x = b by LDL^T without pivots or square roots, which positive matrices do not need. Of the
// lower triangle; loops of a known length, which the compiler unrolls. False when a pivot is not
// positive.
template <int N>
bool solve_positive(const Eigen::Matrix<double, N, N>& A, const Eigen::Matrix<double, N, 1>& b,
                    Eigen::Matrix<double, N, 1>& x) {
  double L[N][N], inverse[N], y[N];
  for (int j = 0; j < N; ++j) {
    double pivot = A(j, j);
    for (int k = 0; k < j; ++k) {
      const double scaled = L[j][k];  // L_jk D_k
      L[j][k] *= inverse[k];
      pivot -= scaled * L[j][k];
    }
    if (!(pivot > 0)) return false;
    inverse[j] = 1 / pivot;
    for (int i = j + 1; i < N; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      L[i][j] = sum;  // times D_j, until row i is reached
    }
    y[j] = b[j];
    for (int k = 0; k < j; ++k) y[j] -= L[j][k] * y[k];
  }
  for (int j = N - 1; j >= 0; --j) {
    double sum = y[j] * inverse[j];
    for (int i = j + 1; i < N; ++i) sum -= L[i][j] * x[i];
    x[j] = sum;
  }
  return true;
}

// A x = b. False when A is not what `form` promises, or the answer is not finite.
template <int N>
bool solve_system(h6Gradient form, const Eigen::Matrix<double, N, N>& A,
                  const Eigen::Matrix<double, N, 1>& b, Eigen::Matrix<double, N, 1>& x) {
  if (form == H6_EXACT) {
    x = A.partialPivLu().solve(b);
  } else {
    if (solve_positive<N>(A, b, x)) return x.allFinite();
    // Semidefinite, or nearly: with pivots.
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
