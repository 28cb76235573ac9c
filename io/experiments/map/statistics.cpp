// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/statistics.h"

#include <algorithm>
#include <cmath>

namespace h6::cli {
namespace {

constexpr double kTail = 0.025;
constexpr double kNormal = 1.959963984540054;  // the normal distribution has kTail above it

// The probability of at most k hits out of n, each of probability p.
double at_most_hits(std::size_t k, std::size_t n, double p) {
  if (p <= 0) return 1;
  if (p >= 1) return k >= n ? 1 : 0;
  double sum = 0, log_term = static_cast<double>(n) * std::log1p(-p);
  for (std::size_t i = 0; i <= k; ++i) {
    sum += std::exp(log_term);
    log_term += std::log(static_cast<double>(n - i) / static_cast<double>(i + 1)) + std::log(p) -
                std::log1p(-p);
  }
  return std::min(sum, 1.0);
}

// The p at which at most k hits out of n have the probability `tail`, by bisection; k < n.
double share_of_tail(std::size_t k, std::size_t n, double tail) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (at_most_hits(k, n, middle) > tail ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

Interval wilson(std::size_t hits, std::size_t of) {
  if (of == 0) return {0, 1};
  const double n = static_cast<double>(of), p = static_cast<double>(hits) / n;
  const double z2 = kNormal * kNormal, middle = p + z2 / (2 * n);
  const double half = kNormal * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  // Without hits, or with hits only, one end is exact; rounding would miss it.
  return {hits == 0 ? 0 : (middle - half) / (1 + z2 / n),
          hits == of ? 1 : (middle + half) / (1 + z2 / n)};
}

Interval exact_share(std::size_t hits, std::size_t of) {
  return {hits == 0 ? 0 : share_of_tail(hits - 1, of, 1 - kTail),
          hits == of ? 1 : share_of_tail(hits, of, kTail)};
}

double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  const double at = share * static_cast<double>(sorted.size() - 1);
  const std::size_t below = static_cast<std::size_t>(at);
  if (below + 1 >= sorted.size()) return sorted.back();
  const double part = at - static_cast<double>(below);
  return sorted[below] + part * (sorted[below + 1] - sorted[below]);
}

std::optional<Interval> median_interval(const std::vector<double>& sorted) {
  const std::size_t n = sorted.size();
  std::size_t cut = 0;  // values that are left out at either end
  while (2 * cut < n && at_most_hits(cut, n, 0.5) <= kTail) ++cut;
  if (cut == 0) return std::nullopt;
  return Interval{sorted[cut - 1], sorted[n - cut]};
}

}  // namespace h6::cli
