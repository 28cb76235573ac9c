// SPDX-License-Identifier: Apache-2.0
// batch.h - many sessions of the peg in its hole: h6StepMany beside ODE and Bullet.
#pragma once
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/file/progress.h"

namespace h6::peers {

struct BatchRow {
  std::string peer;
  std::size_t sessions;
  double per_second[2];  // steps, on one thread and on two: the best of several turns
  double contacts;       // of a session
};

// 1, 64, 1,024 and 16,384 sessions; the rows of the engine come first. A step of the engine is
// whole (contacts, weights, coupling, motion). A step of the others is the contacts of the two
// meshes at the pose that the session has reached; two cores are two processes of theirs.
Result<std::vector<BatchRow>> compare_batches(const io::Progress& progress);

}  // namespace h6::peers
