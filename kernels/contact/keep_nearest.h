// SPDX-License-Identifier: Apache-2.0
// keep_nearest.h - of many points those with the least distances, in the order in which they came.
#pragma once
#include "kernels/contact/touch_groups.h"

namespace h6::kernels {

// The k-th least of `count` distances (1 <= k <= count) and how many are less than it. No NaN; -0
// is 0.
struct NearestLimit {
  float limit;
  std::size_t below;
};
NearestLimit nearest_limit(const float* distance, std::size_t count, std::size_t k);
NearestLimit nearest_limit_ref(const float* distance, std::size_t count, std::size_t k);

// Of rows [begin, end) of `points` those below the limit, and the first `ties` of those at it, move
// to `to` and on; to <= begin. Returns how many; `ties` is left with what it has not given.
std::size_t keep_nearest(const Touching& points, std::size_t begin, std::size_t end, float limit,
                         std::size_t& ties, std::size_t to);
std::size_t keep_nearest_ref(const Touching& points, std::size_t begin, std::size_t end,
                             float limit, std::size_t& ties, std::size_t to);

}  // namespace h6::kernels
