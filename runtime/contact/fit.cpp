// SPDX-License-Identifier: Apache-2.0
// fit.cpp - takes the relief of points off their depths.
#include "runtime/contact/fit.h"

#include <algorithm>

namespace h6 {
namespace {

void keep(const kernels::Touching& c, std::size_t from, std::size_t to, float distance) {
  c.distance[to] = distance;
  if (from == to) return;
  c.row[to] = c.row[from];
  c.gx[to] = c.gx[from], c.gy[to] = c.gy[from], c.gz[to] = c.gz[from];
}

// Walks along the ascending lists of candidates and of points with relief, and closes the gaps that
// free points leave in the latter.
class Release {
 public:
  Release(PairFit& fit, float margin) : fit_(fit), margin_(margin) {}
  ~Release() { fit_.count = kept_; }
  float relief_of(std::uint32_t row, float distance) {
    while (next_ < fit_.count && fit_.row[next_] < row) ++next_;
    if (next_ == fit_.count || fit_.row[next_] != row) return 0;
    const float relief = fit_.relief[next_++];
    if (!(distance < margin_)) return 0;
    fit_.row[kept_] = row;
    fit_.relief[kept_++] = relief;
    return relief;
  }

 private:
  PairFit& fit_;
  float margin_;
  std::size_t next_ = 0, kept_ = 0;
};

float find_relief(const PairFit& fit, std::uint32_t row) {
  const std::uint32_t* const end = fit.row + fit.count;
  const std::uint32_t* const at = std::lower_bound<const std::uint32_t*>(fit.row, end, row);
  return at != end && *at == row ? fit.relief[at - fit.row] : 0;
}

template <class ReliefOf>
std::size_t relieve_each(PairFit& fit, const kernels::Touching& c, std::size_t count,
                         const FitRule& rule, ReliefOf&& relief_of) {
  std::size_t kept = 0;
  fit.deepest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    fit.deepest = std::max(fit.deepest, -c.distance[i]);
    const float distance = c.distance[i] + rule.offset;
    const float relieved = distance + relief_of(c.row[i], distance);
    if (relieved < rule.margin) keep(c, i, kept++, relieved);
  }
  return kept;
}

}  // namespace

std::size_t relieve(PairFit& fit, const kernels::Touching& candidates, std::size_t count,
                    const FitRule& rule, bool complete) {
  if (!complete)
    return relieve_each(fit, candidates, count, rule,
                        [&](std::uint32_t row, float) { return find_relief(fit, row); });
  Release release(fit, rule.margin);
  return relieve_each(fit, candidates, count, rule, [&](std::uint32_t row, float distance) {
    return release.relief_of(row, distance);
  });
}

}  // namespace h6
