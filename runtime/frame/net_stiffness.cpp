// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/net_stiffness.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "runtime/frame/stages.h"
#include "runtime/frame/weighing.h"

namespace h6 {

StiffnessRange stiffness_range(const Mat6& B, double lever) {
  Vec6 scale;
  scale << 1, 1, 1, 1 / lever, 1 / lever, 1 / lever;
  const Mat6 scaled = scale.asDiagonal() * B * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(scaled, Eigen::EigenvaluesOnly);
  return {solver.eigenvalues()[0], solver.eigenvalues()[5]};
}

void report_net_stiffness(h6Session& s) {
  bool first_body = true;
  for (std::size_t first = 0, end; first < s.pair_count; first = end) {
    end = pairs_of_shell(s, first);
    Mat6 B = Mat6::Zero();
    for (std::size_t p = first; p < end; ++p) B += s.pairs[p].B;
    if (B.isZero(0)) continue;
    const Body& body = s.bodies[s.pairs[first].a];
    const StiffnessRange range = stiffness_range(B, series_lever(body.radius, body.voxel));
    double &least = s.report.net_stiffness_min, &most = s.report.net_stiffness_max;
    least = first_body ? range.least : std::min(least, range.least);
    most = first_body ? range.most : std::max(most, range.most);
    first_body = false;
  }
}

}  // namespace h6
