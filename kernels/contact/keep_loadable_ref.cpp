// SPDX-License-Identifier: Apache-2.0
// keep_loadable_ref.cpp - the specification of keep_loadable.h, one row at a time.
#include "kernels/contact/keep_loadable.h"

#include <algorithm>
#include <cmath>

namespace h6::kernels {
namespace {

struct Way {
  float q[3];
  Way(const float ahead[6], float x, float y, float z)
      : q{ahead[0] + (ahead[4] * z - ahead[5] * y), ahead[1] + (ahead[5] * x - ahead[3] * z),
          ahead[2] + (ahead[3] * y - ahead[4] * x)} {}
  float along(float x, float y, float z) const { return x * q[0] + y * q[1] + z * q[2]; }
};

}  // namespace

std::size_t keep_loadable_ref(const ShellColumns& s, const Touching& rows, std::size_t count,
                              const float ahead[6]) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t r = rows.row[i];
    const Way way(ahead, s.x[r], s.y[r], s.z[r]);
    if (!(std::max(0.0f, -way.along(s.nx[r], s.ny[r], s.nz[r])) > rows.distance[i])) continue;
    for (float* column : {rows.distance, rows.gx, rows.gy, rows.gz}) column[kept] = column[i];
    rows.row[kept++] = r;
  }
  return kept;
}

std::size_t loadable_groups_ref(const SpheresView& groups, const BundlesView& normals,
                                const float ahead[6], float most, const float* expiry,
                                const float* now, const std::uint32_t* blocks, std::size_t count,
                                float* reach, std::uint32_t* survivors) {
  const float turn = std::hypot(ahead[3], ahead[4], ahead[5]);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < kBlock * count; ++k) {
    const auto g = static_cast<std::uint32_t>(kBlock * blocks[k / kBlock] + k % kBlock);
    const Way way(ahead, groups.x[g], groups.y[g], groups.z[g]);
    const float towards = -way.along(normals.nx[g], normals.ny[g], normals.nz[g]);
    const float size = std::sqrt(way.along(way.q[0], way.q[1], way.q[2]));
    const float most_here = towards + normals.spread[g] * size + turn * groups.radius[g];
    reach[g] = std::min(most, std::max(0.0f, most_here));
    if (expiry[g] <= now[g / kBlock] + reach[g]) survivors[kept++] = g;
  }
  return kept;
}

}  // namespace h6::kernels
