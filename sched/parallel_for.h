// SPDX-License-Identifier: Apache-2.0
// parallel_for.h - one loop over independent pieces, oneTBB behind it. For baking and loading, not
// for the frame (see frame_team.h).
#pragma once
#include <cstddef>
#include <functional>

namespace h6::sched {

// Calls body(i) once for every i in 0..count-1, in any order, on up to `threads` threads (0: all of
// the machine's), and returns when all are done. A body must not throw.
void parallel_for(std::size_t count, unsigned threads,
                  const std::function<void(std::size_t)>& body);

// How many threads 0 means.
unsigned machine_threads();

}  // namespace h6::sched
