// SPDX-License-Identifier: Apache-2.0
// eigen_host.cpp - prints what every weight rule makes of 500 contacts, in hexadecimal. With
// HOST_EIGEN it also uses Eigen and the standard library as the engine does inside.
#include <hapsix/hapsix.h>

#include <cmath>
#include <cstdio>
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

int main() {
  if (!(std::fabs(host()) > 0)) return 1;
  const std::size_t count = 500;
  std::vector<float> normals, arms, depths;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double r = std::sqrt(1 - z * z), a = 2.399963229728653 * static_cast<double>(i);
    const double p[3] = {r * std::cos(a), r * std::sin(a), z};
    for (const double x : p)
      normals.push_back(static_cast<float>(-x)), arms.push_back(static_cast<float>(0.02 * x));
    depths.push_back(static_cast<float>(1e-4 * (1 + std::sin(5 * a))));
  }
  h6ContactArrays arrays{};
  arrays.count = count;
  arrays.normals = normals.data(), arrays.arms = arms.data(), arrays.depths = depths.data();
  for (int method = 0; method < H6_METHOD_COUNT; ++method) {
    h6ContactDef def = h6DefaultContactDef();
    def.method = static_cast<h6Method>(method);
    h6Wrench w;
    double stiffness[36], damping[36], sum = 0;
    h6Error error;
    if (h6WeighContacts(&def, &arrays, 1e-3, 0.02, nullptr, &w, stiffness, damping, &error) != 0) {
      std::printf("%s\n", error.message);
      return 1;
    }
    for (int i = 0; i < 36; ++i) sum += stiffness[i] * (i + 1) + damping[i];
    std::printf("%s %a %a %a %a %a %a %a\n", h6MethodName(def.method), w.force.x, w.force.y,
                w.force.z, w.torque.x, w.torque.y, w.torque.z, sum);
  }
  return 0;
}
