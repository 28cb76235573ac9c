// SPDX-License-Identifier: Apache-2.0
// start_overlap.h - the overlap of shells and fields at the start of a session, and the relief that
// follows from it.
#pragma once
#include <cstddef>
#include <cstdint>

#include "hapsix/hapsix.h"

namespace h6 {

// The measured overlap, and the columns that the pairs' PairFit point into, in one block of memory.
// Without an overlap there is none.
struct StartOverlap {
  h6Overlap* pairs = nullptr;  // those that overlap
  h6OverlapPoint* points = nullptr;
  std::uint32_t* rows = nullptr;  // (points) of the shells
  std::size_t pair_count = 0, point_count = 0;
  void* memory = nullptr;
  std::size_t memory_bytes = 0;
};

// Measures the overlap at the present poses. Under `relieve` it also sets the relief of all points.
// Returns false and changes nothing when fit_offset is too large for a field, or memory is out.
bool measure_overlap(h6Session& s, h6Error* error);
void forget_overlap(h6Session& s);
// No point of the pairs of this body has relief any more.
void forget_relief(h6Session& s, std::int32_t body);

// Points of `next` keep the relief that they have left in `before`. Does not allocate.
void take_over_relief(h6Session& next, const h6Session& before);

}  // namespace h6
