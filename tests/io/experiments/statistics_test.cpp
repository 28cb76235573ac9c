// SPDX-License-Identifier: Apache-2.0
// Tests shares, medians and their intervals against closed forms.
#include "io/experiments/map/statistics.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace h6::cli;

namespace {

constexpr double kZ = 1.959963984540054;

// The probability of k hits out of n.
double chance(std::size_t k, std::size_t n, double p) {
  double ways = 1;
  for (std::size_t i = 0; i < k; ++i)
    ways *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  return ways * std::pow(p, static_cast<double>(k)) * std::pow(1 - p, static_cast<double>(n - k));
}

}  // namespace

TEST_CASE("Wilson's interval is the closed form at none, half and all") {
  for (const std::size_t n : {1u, 2u, 10u, 400u}) {
    const double d = static_cast<double>(n), z2 = kZ * kZ;
    CHECK(wilson(0, n).low == 0);
    CHECK(wilson(0, n).high == doctest::Approx(z2 / (d + z2)));
    CHECK(wilson(n, n).low == doctest::Approx(d / (d + z2)));
    CHECK(wilson(n, n).high == 1);
    const Interval half = wilson(n, 2 * n);
    CHECK(half.low == doctest::Approx(0.5 - 0.5 * kZ / std::sqrt(2 * d + z2)));
    CHECK(half.high == doctest::Approx(0.5 + 0.5 * kZ / std::sqrt(2 * d + z2)));
  }
  CHECK(wilson(0, 0).low == 0);
  CHECK(wilson(0, 0).high == 1);
}

TEST_CASE("the exact interval is the closed form where there is one") {
  for (const std::size_t n : {1u, 6u, 50u}) {
    const double root = std::pow(0.025, 1 / static_cast<double>(n));
    CHECK(exact_share(0, n).high == doctest::Approx(1 - root));
    CHECK(exact_share(n, n).low == doctest::Approx(root));
    CHECK(exact_share(0, n).low == 0);
    CHECK(exact_share(n, n).high == 1);
  }
  CHECK(exact_share(1, 2).high == doctest::Approx(std::sqrt(0.975)));
  CHECK(exact_share(1, 2).low == doctest::Approx(1 - std::sqrt(0.975)));
  CHECK(exact_share(0, 0).low == 0);
  CHECK(exact_share(0, 0).high == 1);
  // The sign test: five of five may be chance, six of six are not.
  CHECK(exact_share(5, 5).low < 0.5);
  CHECK(exact_share(6, 6).low > 0.5);
}

TEST_CASE("the exact interval holds the true share in 95 % of all samples, whatever the share") {
  constexpr std::size_t kMany = 23;
  for (double p = 0.01; p < 1; p += 0.01) {
    double covered = 0;
    for (std::size_t k = 0; k <= kMany; ++k)
      if (const Interval i = exact_share(k, kMany); i.low <= p && p <= i.high)
        covered += chance(k, kMany, p);
    CHECK(covered >= 0.95);
  }
}

TEST_CASE("the interval of a median leaves out as many values as the sign test allows") {
  const auto of = [](int n) {
    std::vector<double> values;
    for (int i = 1; i <= n; ++i) values.push_back(i);
    return median_interval(values);
  };
  CHECK_FALSE(of(0));
  CHECK_FALSE(of(5));  // 2 / 32 is above 5 %
  REQUIRE(of(6));      // 2 / 64 is not
  CHECK(of(6)->low == 1);
  CHECK(of(6)->high == 6);
  CHECK(of(8)->low == 1);  // 2 (1 + 8) / 256 is above 5 %
  CHECK(of(9)->low == 2);  // 2 (1 + 9) / 512 is not
  CHECK(of(9)->high == 8);
  CHECK(of(100)->low == 40);  // as in tables of the sign test
  CHECK(of(100)->high == 61);
}

TEST_CASE("quantiles are interpolated between the sorted values") {
  CHECK(quantile({}, 0.5) == 0);
  CHECK(quantile({7}, 0.95) == 7);
  CHECK(quantile({1, 2, 3, 5}, 0) == 1);
  CHECK(quantile({1, 2, 3, 5}, 0.5) == 2.5);
  CHECK(quantile({1, 2, 3, 5}, 1) == 5);
}
