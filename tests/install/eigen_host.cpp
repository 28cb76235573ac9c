// SPDX-License-Identifier: Apache-2.0
// eigen_host.cpp - prints what every weight rule makes of 500 contacts, in hexadecimal. With
// HOST_EIGEN it also does so with an Eigen of its own.
#include <hapsix/hapsix.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "host_eigen.h"

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
