// solve_test.cpp - the step's system: answers satisfy it, and what is not positive is refused.
#include <doctest/doctest.h>

#include <random>

#include "runtime/solve.h"

using namespace h6;

namespace {
double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}

template <int N>
void check_random_systems() {
  std::mt19937_64 random(N);
  using M = Eigen::Matrix<double, N, N>;
  using V = Eigen::Matrix<double, N, 1>;
  for (int i = 0; i < 2000; ++i) {
    M J;
    V b, x;
    for (int k = 0; k < N * N; ++k) J(k) = uniform(random);
    for (int k = 0; k < N; ++k) b[k] = uniform(random);
    // Units a million apart, as newtons and newton metres of a small part are.
    V scale;
    for (int k = 0; k < N; ++k) scale[k] = k % 6 < 3 ? 1 : 1e-3;
    const M A = scale.asDiagonal() * (J * J.transpose() + 1e-3 * M::Identity()) *
                scale.asDiagonal();
    REQUIRE(solve_system<N>(H6_SYMMETRIC, A, b, x));
    const V rest = A * x - b;
    CHECK(rest.norm() <= 1e-9 * (A.norm() * x.norm() + b.norm()));
    const V eigen = A.ldlt().solve(b);
    CHECK((x - eigen).norm() <= 1e-8 * eigen.norm());
    M bad = A;
    bad.diagonal()[i % N] = -A(i % N, i % N);
    CHECK_FALSE(solve_system<N>(H6_SYMMETRIC, bad, b, x));
    bad(0, 0) = std::nan("");
    CHECK_FALSE(solve_system<N>(H6_SYMMETRIC, bad, b, x));
  }
}
}  // namespace

TEST_CASE("positive systems of one and of two bodies are solved; others are refused") {
  check_random_systems<6>();
  check_random_systems<12>();
}
