// SPDX-License-Identifier: Apache-2.0
// host_eigen.h - what a program does by itself: with HOST_EIGEN it uses Eigen and the standard library
// as hapsix does inside.
#pragma once
#include <vector>

#ifdef HOST_EIGEN
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace {
template <int N, int Most>
double work(int n) {
  using Matrix = Eigen::Matrix<double, N, N, 0, Most, Most>;
  using Vector = Eigen::Matrix<double, N, 1, 0, Most, 1>;
  Matrix a = Matrix::Random(n, n);
  a = (a * a.transpose()).eval();
  a.diagonal().array() += 1;
  const Vector b = Vector::Random(n);
  double sum = a.inverse().sum() + a.determinant();
  sum += Vector(a.ldlt().solve(b)).sum() + Vector(a.partialPivLu().solve(b)).sum();
  return sum;
}
double host() {
  std::vector<double> values(100, 1.0);
  values.resize(1000, 2.0);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  return work<3, 3>(3) + work<6, 6>(6) + work<Eigen::Dynamic, 24>(18) + q.toRotationMatrix().sum() +
         values.back();
}
}  // namespace
#else
namespace {
double host() { return 1; }
}  // namespace
#endif
