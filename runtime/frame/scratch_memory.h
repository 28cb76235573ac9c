// SPDX-License-Identifier: Apache-2.0
// scratch_memory.h - the scratch of a thread that steps sessions: what a step needs and no step
// remembers. A session has its own, or borrows that of the workers that step it.
#pragma once
#include "runtime/base/arena.h"
#include "runtime/contact/lane.h"
#include "runtime/contact/settings.h"

namespace h6 {

// How much a scratch holds: rows, and bytes for the weights.
struct ScratchRoom {
  std::size_t groups = 16, blocks = 16;  // of the largest shell
  std::size_t contacts = 0;              // of a shell body
  std::size_t merged = 0, rubbing = 0;   // contacts that clusters and friction look at
  std::size_t weighing = 0;              // [B]
  bool slices = false;                   // several threads may search one pair
  bool operator==(const ScratchRoom&) const = default;
};
// Room for shell bodies with these settings, of up to so many groups and blocks.
ScratchRoom scratch_room(const Settings& set, std::size_t groups, std::size_t blocks);
// The least that is enough for either.
ScratchRoom either(const ScratchRoom& a, const ScratchRoom& b);

// `weighs`: a thread that only searches for contacts needs less.
void lay_out_scratch(Scratch& scratch, Arena& arena, const ScratchRoom& room, bool weighs);
// One row for each group and block of a shell.
SearchColumns take_search(Arena& arena, std::size_t groups, std::size_t blocks);

}  // namespace h6
