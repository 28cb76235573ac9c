// SPDX-License-Identifier: Apache-2.0
// solve.cpp - the factorisations of a step. They share one file, because Eigen compiles slowly.
#include "runtime/motion/solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

// Unrolled loops keep one body's system in registers, which is twice as fast.
#if defined(__GNUC__) && !defined(__clang__)
#define H6_UNROLL_SIX _Pragma("GCC unroll 6")
#elif defined(__clang__)
#define H6_UNROLL_SIX _Pragma("unroll(6)")
#else
#define H6_UNROLL_SIX
#endif

namespace h6 {
namespace {

// Solves A x = b by LDL^T, from the lower triangle, without pivoting or square roots, which
// positive matrices do not need. Each column is eliminated from all later ones at once, so that
// only pivots depend on one another. Returns false if a pivot is not positive.
template <class Matrix, class Vector>
bool solve_positive(const Matrix& A, const Vector& b, Vector& x) {
  constexpr int kMost = Matrix::MaxRowsAtCompileTime;
  const int n = int(b.size());
  double rest[kMost][kMost], L[kMost][kMost], inverse[kMost], y[kMost];  // L by columns
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) rest[i][j] = A(i, j);
    y[i] = b[i];
  }
  H6_UNROLL_SIX
  for (int j = 0; j < n; ++j) {
    if (!(rest[j][j] > 0)) return false;
    inverse[j] = 1 / rest[j][j];
    H6_UNROLL_SIX
    for (int i = j + 1; i < n; ++i) L[j][i] = rest[i][j] * inverse[j];
    H6_UNROLL_SIX
    for (int i = j + 1; i < n; ++i) {
      H6_UNROLL_SIX
      for (int k = j + 1; k <= i; ++k) rest[i][k] -= rest[i][j] * L[j][k];
      y[i] -= L[j][i] * y[j];
    }
  }
  for (int j = 0; j < n; ++j) y[j] *= inverse[j];
  x.resize(n);
  H6_UNROLL_SIX
  for (int j = n - 1; j >= 0; --j) {
    x[j] = y[j];
    H6_UNROLL_SIX
    for (int i = 0; i < j; ++i) y[i] -= L[i][j] * y[j];
  }
  return true;
}

template <class Matrix, class Vector>
bool solve(h6Gradient form, const Matrix& A, const Vector& b, Vector& x) {
  if (form == H6_EXACT) {
    x = A.partialPivLu().solve(b);
  } else {
    if (solve_positive(A, b, x)) return x.allFinite();
    // A semidefinite matrix, or one nearly so, needs pivoting.
    const Eigen::LDLT<Matrix> factors(A);
    if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
    x = factors.solve(b);
  }
  return x.allFinite();
}

}  // namespace

bool solve_system(h6Gradient form, const Mat6& A, const Vec6& b, Vec6& x) {
  return solve(form, A, b, x);
}
bool solve_system(h6Gradient form, const IslandMatrix& A, const IslandVector& b, IslandVector& x) {
  return solve(form, A, b, x);
}

}  // namespace h6
