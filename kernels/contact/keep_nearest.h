// SPDX-License-Identifier: Apache-2.0
// keep_nearest.h - keeps the points with the least keys, such as distances, in their order.
#pragma once
#include "kernels/contact/touch_groups.h"

namespace h6::kernels {

// The k-th least of `count` keys (1 <= k <= count) and the number of keys below it. No NaN; -0
// counts as 0.
struct NearestLimit {
  float limit;
  std::size_t below;
};
NearestLimit nearest_limit(const float* key, std::size_t count, std::size_t k);
NearestLimit nearest_limit_ref(const float* key, std::size_t count, std::size_t k);

// Moves the rows of [begin, end) of `points` and `key` (may be points.distance) whose key is below
// the limit, and the first `ties` rows that are equal to it, to rows `to` and on; to <= begin.
// Returns the number of rows moved; `ties` is reduced by the number of equal rows among them.
std::size_t keep_nearest(const Touching& points, float* key, std::size_t begin, std::size_t end,
                         float limit, std::size_t& ties, std::size_t to);
std::size_t keep_nearest_ref(const Touching& points, float* key, std::size_t begin, std::size_t end,
                             float limit, std::size_t& ties, std::size_t to);

}  // namespace h6::kernels
