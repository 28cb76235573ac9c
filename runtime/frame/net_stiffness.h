// SPDX-License-Identifier: Apache-2.0
// net_stiffness.h - how stiff a shell body's contacts are together, whatever their number.
// METHOD.md, Sec. 3.
#pragma once
#include "runtime/frame/session.h"

namespace h6 {

struct StiffnessRange {
  double least, most;  // [N/m]
};
// Extreme eigenvalues of S B S, S = diag(1, 1, 1, 1/lever, ...): B = sum w k J J^T, symmetric.
StiffnessRange stiffness_range(const Mat6& B, double lever);

// Into the report, from what the sums of this frame left in the pairs.
void report_net_stiffness(h6Session& s);

}  // namespace h6
