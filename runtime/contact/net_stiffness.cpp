// SPDX-License-Identifier: Apache-2.0
// net_stiffness.cpp - the extreme eigenvalues of a shell body's contact stiffness.
#include "runtime/contact/net_stiffness.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "runtime/contact/weighing.h"

namespace h6 {

StiffnessRange stiffness_range(const Mat6& B, double lever) {
  Vec6 scale;
  scale << 1, 1, 1, 1 / lever, 1 / lever, 1 / lever;
  const Mat6 scaled = scale.asDiagonal() * B * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(scaled, Eigen::EigenvaluesOnly);
  return {solver.eigenvalues()[0], solver.eigenvalues()[5]};
}

void report_net_stiffness(std::span<const Body> bodies, std::span<const ShellBody> shells,
                          h6FrameReport& report) {
  bool first = true;
  for (const ShellBody& shell : shells) {
    Mat6 B = Mat6::Zero();
    for (const Pair& pair : shell.pairs) B += pair.B;
    if (B.isZero(0)) continue;
    const Body& body = bodies[shell.body];
    const StiffnessRange range = stiffness_range(B, series_lever(body.radius, body.voxel));
    double &least = report.net_stiffness_min, &most = report.net_stiffness_max;
    least = first ? range.least : std::min(least, range.least);
    most = first ? range.most : std::max(most, range.most);
    first = false;
  }
}

}  // namespace h6
