// SPDX-License-Identifier: Apache-2.0
// parallel_for.h - a parallel loop over independent pieces, by oneTBB. For baking and loading; a
// frame uses frame_team.h.
#pragma once
#include <cstddef>
#include <functional>

namespace h6::sched {

// Calls body(i) once for every i in 0..count-1, in any order, on up to `threads` threads (0: as
// many as the machine has), and returns when all are done. The body must not throw.
void parallel_for(std::size_t count, unsigned threads,
                  const std::function<void(std::size_t)>& body);

// How many threads the machine has.
unsigned machine_threads();
// How many threads such a number asks for: 0, and more than the machine has, are all of them.
unsigned usable_threads(unsigned threads);

}  // namespace h6::sched
