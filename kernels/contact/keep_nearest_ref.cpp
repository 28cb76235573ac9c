// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "kernels/contact/keep_nearest.h"

namespace h6::kernels {

NearestLimit nearest_limit_ref(const float* distance, std::size_t count, std::size_t k) {
  std::vector<float> sorted(distance, distance + count);
  std::sort(sorted.begin(), sorted.end());
  const float limit = sorted[k - 1];
  return {limit, std::size_t(std::count_if(distance, distance + count,
                                           [&](float d) { return d < limit; }))};
}

std::size_t keep_nearest_ref(const Touching& p, float* key, std::size_t begin, std::size_t end,
                             float limit, std::size_t& ties, std::size_t to) {
  const std::size_t first = to;
  for (std::size_t i = begin; i < end; ++i) {
    const float k = key[i];
    if (k > limit || (k == limit && ties == 0)) continue;
    ties -= k == limit;
    p.row[to] = p.row[i];
    p.distance[to] = p.distance[i];
    key[to] = k;
    p.gx[to] = p.gx[i], p.gy[to] = p.gy[i], p.gz[to] = p.gz[i];
    ++to;
  }
  return to - first;
}

}  // namespace h6::kernels
