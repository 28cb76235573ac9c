// SPDX-License-Identifier: Apache-2.0
// shell_lanes.h - shell bodies side by side on the two threads: two hands, each with its own part.
//
// Traversal, contacts and weights of one shell body are nobody else's business until the wrenches
// are summed. Each thread works on a lane: the session itself, with scratch and report of its own
// and nobody to share slices with. Wrenches are then summed in order, so bits do not depend on it.
#pragma once
#include <cstddef>

#include "runtime/base/arena.h"

struct h6Session;

namespace h6 {

// Scratch of the second lane; the first one has the session's. What a session gets in scratch that
// traversal, contacts or weights write to, it gets here too.
struct LaneScratch {
  std::uint32_t *cluster_order = nullptr, *cluster_root = nullptr;
  std::uint64_t* cluster_cell = nullptr;
  char* weigh = nullptr;
};

// After all else of the session is laid out and set.
void open_lanes(h6Session& s);
// Is there enough for two, in several shell bodies?
bool worth_lanes(const h6Session& s);
// `job(lane, first pair, end)` for every shell body, on either thread; then the reports are joined.
using ShellJob = void (*)(h6Session& lane, std::size_t first_pair, std::size_t end_pair);
void run_lanes(h6Session& s, ShellJob job);

}  // namespace h6
