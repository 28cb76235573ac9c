// solve.h - the dense system of a step: symmetric positive by LDL^T, anything else by pivoted LU.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "runtime/math.h"

// One body's system all in registers, without a loop: twice as fast.
#if defined(__GNUC__) && !defined(__clang__)
#define H6_UNROLL_SIX _Pragma("GCC unroll 6")
#elif defined(__clang__)
#define H6_UNROLL_SIX _Pragma("unroll(6)")
#else
#define H6_UNROLL_SIX
#endif

namespace h6 {

// A x = b by LDL^T without pivots or square roots, which positive matrices do not need. Of the
// lower triangle. What follows from a column is taken from all behind it at once, so that only
// pivots wait for one another. False when a pivot is not positive.
template <int N>
bool solve_positive(const Eigen::Matrix<double, N, N>& A, const Eigen::Matrix<double, N, 1>& b,
                    Eigen::Matrix<double, N, 1>& x) {
  double rest[N][N], L[N][N], inverse[N], y[N];  // L by columns
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j <= i; ++j) rest[i][j] = A(i, j);
    y[i] = b[i];
  }
  H6_UNROLL_SIX
  for (int j = 0; j < N; ++j) {
    if (!(rest[j][j] > 0)) return false;
    inverse[j] = 1 / rest[j][j];
    H6_UNROLL_SIX
    for (int i = j + 1; i < N; ++i) L[j][i] = rest[i][j] * inverse[j];
    H6_UNROLL_SIX
    for (int i = j + 1; i < N; ++i) {
      H6_UNROLL_SIX
      for (int k = j + 1; k <= i; ++k) rest[i][k] -= rest[i][j] * L[j][k];
      y[i] -= L[j][i] * y[j];
    }
  }
  for (int j = 0; j < N; ++j) y[j] *= inverse[j];
  H6_UNROLL_SIX
  for (int j = N - 1; j >= 0; --j) {
    x[j] = y[j];
    H6_UNROLL_SIX
    for (int i = 0; i < j; ++i) y[i] -= L[i][j] * y[j];
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

#undef H6_UNROLL_SIX
