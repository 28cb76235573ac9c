// SPDX-License-Identifier: Apache-2.0
// net_stiffness.h - the net stiffness of all contacts of a shell body. METHOD.md, Sec. 3.
#pragma once
#include "runtime/contact/pair.h"

namespace h6 {

struct StiffnessRange {
  double least, most;  // [N/m]
};
// Extreme eigenvalues of S B S, S = diag(1, 1, 1, 1/lever, ...): B = sum w k J J^T, symmetric.
StiffnessRange stiffness_range(const Mat6& B, double lever);

// The range over all shell bodies that touch something, from the pairs' B of this frame.
void report_net_stiffness(std::span<const Body> bodies, std::span<const ShellBody> shells,
                          h6FrameReport& report);

}  // namespace h6
