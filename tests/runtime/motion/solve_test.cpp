// SPDX-License-Identifier: Apache-2.0
// solve_test.cpp - the system of a step: solutions satisfy it, and a matrix that is not positive is
// refused.
#include <doctest/doctest.h>

#include <random>

#include <Eigen/Cholesky>

#include "runtime/base/solve_positive.h"
#include "runtime/motion/solve.h"

using namespace h6;

namespace {
double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}

template <class M, class V>
void check_random_systems(int n) {
  std::mt19937_64 random(static_cast<unsigned>(n));
  for (int i = 0; i < 2000; ++i) {
    M J = M::Zero(n, n);
    V b = V::Zero(n), x;
    for (int k = 0; k < n * n; ++k) J(k) = uniform(random);
    for (int k = 0; k < n; ++k) b[k] = uniform(random);
    // Units a million apart, as newtons and newton metres of a small part are.
    V scale = V::Ones(n);
    for (int k = 0; k < n; ++k) scale[k] = k % 6 < 3 ? 1 : 1e-3;
    const M A =
        scale.asDiagonal() * (J * J.transpose() + 1e-3 * M::Identity(n, n)) * scale.asDiagonal();
    REQUIRE(solve_system(H6_SYMMETRIC, A, b, x));
    const V rest = A * x - b;
    CHECK(rest.norm() <= 1e-9 * (A.norm() * x.norm() + b.norm()));
    const V eigen = A.ldlt().solve(b);
    CHECK((x - eigen).norm() <= 1e-8 * eigen.norm());
    REQUIRE(solve_system(H6_EXACT, A, b, x));  // which takes any matrix
    CHECK((x - eigen).norm() <= 1e-7 * eigen.norm());
    M bad = A;
    bad(i % n, i % n) = -A(i % n, i % n);
    CHECK_FALSE(solve_system(H6_SYMMETRIC, bad, b, x));
    REQUIRE(solve_system(H6_EXACT, bad, b, x));
    CHECK((bad * x - b).norm() <= 1e-9 * (A.norm() * x.norm() + b.norm()));
    bad(0, 0) = std::nan("");
    CHECK_FALSE(solve_system(H6_SYMMETRIC, bad, b, x));
    CHECK_FALSE(solve_system(H6_EXACT, bad, b, x));
  }
}
}  // namespace

TEST_CASE("systems of one body and of islands of two to four are solved; what is not is refused") {
  check_random_systems<Mat6, Vec6>(6);
  for (int bodies = 2; bodies <= kIslandBodies; ++bodies)
    check_random_systems<IslandMatrix, IslandVector>(6 * bodies);
}

TEST_CASE("the inverse of a positive matrix is its inverse to rounding, and symmetric to the bit") {
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    // A spring and a few contacts far stiffer than it, as the common spring of `firm` has.
    Eigen::Matrix<double, 6, 3> J;
    for (int k = 0; k < J.size(); ++k) J(k) = uniform(random);
    Mat6 A = 30 * J * J.transpose();
    A.diagonal().array() += 1;
    const Mat6 inverse = inverse_of_positive(A);
    CHECK((A * inverse - Mat6::Identity()).norm() < 1e-12 * A.norm());
    CHECK(inverse == inverse.transpose());
  }
}
