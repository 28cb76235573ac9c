// SPDX-License-Identifier: Apache-2.0
// statistics.h - shares, medians and their 95 % intervals. Nothing here draws random numbers.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

namespace h6::cli {

struct Interval {
  double low, high;
};

// The interval of a share, `hits` out of `of`: Wilson's score interval (E. B. Wilson, J. Am. Stat.
// Assoc., 1927). 0 .. 1 when `of` is 0.
Interval wilson(std::size_t hits, std::size_t of);

// The exact interval of a share (C. Clopper, E. Pearson, Biometrika, 1934): it never claims too
// much, also for small counts. It excludes 1/2 where the two-sided sign test is below 5 %.
Interval exact_share(std::size_t hits, std::size_t of);

// The value below which `share` of the sorted values lie, interpolated; 0 without values.
double quantile(const std::vector<double>& sorted, double share);

// The interval of the median of the distribution that the sorted values come from, by the sign
// test: no distribution is assumed. None for fewer than 6 values.
std::optional<Interval> median_interval(const std::vector<double>& sorted);

}  // namespace h6::cli
