// SPDX-License-Identifier: Apache-2.0
// solve.cpp - the factorisations of a step. They share one file, because Eigen compiles slowly.
#include "runtime/motion/solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "runtime/base/solve_positive.h"

namespace h6 {
namespace {

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
