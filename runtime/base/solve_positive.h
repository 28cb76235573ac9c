// SPDX-License-Identifier: Apache-2.0
// solve_positive.h - small symmetric positive systems.
#pragma once
#include "runtime/base/math.h"

// Unrolled loops keep one body's system in registers, which is twice as fast.
#if defined(__GNUC__) && !defined(__clang__)
#define H6_UNROLL_SIX _Pragma("GCC unroll 6")
#elif defined(__clang__)
#define H6_UNROLL_SIX _Pragma("unroll(6)")
#else
#define H6_UNROLL_SIX
#endif

namespace h6 {

// Solves A x = b by LDL^T, from the lower triangle, without pivoting or square roots, which
// positive matrices do not need. Each column is eliminated from all later ones at once, so that
// only pivots depend on one another. Returns false if a pivot is not positive.
template <class Matrix, class Vector>
inline bool solve_positive(const Matrix& A, const Vector& b, Vector& x) {
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

// The inverse of A, by the same factors.
inline Mat6 inverse_of_positive(const Mat6& A) {
  double rest[6][6], W[6][6], inverse[6];  // W = L^-1, by rows, with ones on its diagonal
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) rest[i][j] = A(i, j);
  H6_UNROLL_SIX
  for (int j = 0; j < 6; ++j) {
    inverse[j] = 1 / rest[j][j];
    double L[6];
    H6_UNROLL_SIX
    for (int i = j + 1; i < 6; ++i) L[i] = rest[i][j] * inverse[j];
    H6_UNROLL_SIX
    for (int i = j + 1; i < 6; ++i) {
      H6_UNROLL_SIX
      for (int k = j + 1; k <= i; ++k) rest[i][k] -= rest[i][j] * L[k];
      H6_UNROLL_SIX
      for (int k = 0; k < j; ++k) W[i][k] -= L[i] * W[j][k];
      W[i][j] = -L[i];
    }
  }
  Mat6 out;
  H6_UNROLL_SIX
  for (int i = 0; i < 6; ++i) {
    H6_UNROLL_SIX
    for (int j = 0; j <= i; ++j) {
      double sum = inverse[i] * (j < i ? W[i][j] : 1);
      H6_UNROLL_SIX
      for (int k = i + 1; k < 6; ++k) sum += inverse[k] * W[k][i] * W[k][j];
      out(i, j) = out(j, i) = sum;
    }
  }
  return out;
}

}  // namespace h6
