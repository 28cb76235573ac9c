// SPDX-License-Identifier: Apache-2.0
// gauss_cases.h - checks that every way of summing densities must pass.
//
// A Way names `bytes` and `all` of its kernel, and kMost, the most contacts that it is tested with.
// A way that works in stages also has make, slices, run, kStages and kMany, a number of contacts
// for the tests of thousands.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <thread>

#include "tests/kernels/weights/gauss_sets.h"
#include "tests/support/near.h"

namespace h6::kernels::test {

template <class Way>
std::vector<float> weights_of(const DirectionsView& c, Hat hat, const GaussWidths& widths) {
  return weights_in(Way::bytes(c.count, hat), c, hat, widths, Way::all);
}

template <class Way>
double worst_error(Contacts& c, Hat hat, const GaussWidths& widths, bool weighted,
                   std::size_t step = 1) {
  const DirectionsView view = c.view(weighted);
  return worst_of(weights_of<Way>(view, hat, widths), reference_of(view, hat, widths, step), step);
}

template <class Way>
void check_counts() {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c = contacts_of(kSets[n % 8], n, kRobust, n % 5);
      for (Hat hat : kHats) {
        CHECK(worst_error<Way>(c, hat, kRobust, true) <= kTolerance);
        CHECK(worst_error<Way>(c, hat, kPaper, n % 2 == 0) <= kTolerance);
        CHECK(worst_error<Way>(c, hat, {2.0f, 2.0f}, n % 2 == 1) <= kTolerance);
      }
    }
  });
}

template <class Way>
void check_thousands() {
  for (Set set : kSets) {
    for (Hat hat : kHats) {
      for (std::size_t n : {std::size_t{1000}, std::size_t{5003}, Way::kMany}) {
        const GaussWidths width = widths_of(hat);
        Contacts c = contacts_of(set, n, width, 3);
        const DirectionsView view = c.view(n != 1000 || hat == Hat::product);
        const std::vector<float> want = reference_of(view, hat, width, n / 40);
        on_every_target([&](const std::string& target) {
          // The scalar target is slow, and smaller counts test it.
          if (target == "SCALAR" && n > 1000) return;
          CAPTURE(static_cast<int>(set));
          CAPTURE(static_cast<int>(hat));
          CAPTURE(n);
          CHECK(worst_of(weights_of<Way>(view, hat, width), want, n / 40) <= kTolerance);
        });
      }
    }
  }
}

template <class Way>
void check_same_bits_on_any_thread() {
  for (Hat hat : kHats) {
    Contacts c = contacts_of(Set::walls, 6001, widths_of(hat));
    const std::vector<float> want = weights_of<Way>(c.view(true), hat, widths_of(hat));
    std::vector<float> got(c.count);
    std::vector<char> memory(Way::bytes(c.count, hat));
    const auto work = Way::make(c.view(true), hat, widths_of(hat), memory.data(), got.data());
    for (const bool threads : {false, true}) {
      std::fill(got.begin(), got.end(), -1.0f);
      for (int stage = 0; stage < Way::kStages; ++stage) {
        const std::size_t slices = Way::slices(work, stage);
        const auto odd = [&](std::size_t rest) {
          for (std::size_t i = slices; i-- > 0;)
            if (i % 2 == rest) Way::run(work, stage, i);
        };
        if (threads) {
          std::thread other(odd, 1);
          odd(0);
          other.join();
        } else {
          odd(1), odd(0);
        }
      }
      CHECK(same_bits(want.data(), got.data(), got.size()));
    }
  }
}

template <class Way>
void check_coincident() {
  on_every_target([](const std::string&) {
    for (std::size_t most : {std::size_t{1}, std::size_t{17}, std::size_t{1000}, Way::kMost}) {
      const std::size_t n = std::min(most, Way::kMost);
      for (Hat hat : kHats) {
        Contacts c = contacts_of(Set::equal, n, kRobust);
        for (std::size_t i = 0; i < n; ++i) c.column[6][i] = 1, c.column[7][i] = 1e-3f;
        for (const bool weighted : {false, true}) {
          const auto w = weights_of<Way>(c.view(weighted), hat, kRobust);
          CHECK(std::accumulate(w.begin(), w.end(), 0.0) == h6::test::near(1.0).epsilon(1e-5));
        }
      }
    }
  });
}

template <class Way>
void check_bounds() {
  Random random(77);
  on_every_target([&](const std::string&) {
    for (float epsilon : {1e-30f, 1e-4f, 0.01f, 2.0f}) {
      for (Set set : {Set::clump, Set::spread, Set::equal}) {
        Contacts c = contacts_of(set, std::min<std::size_t>(700, Way::kMost),
                                 {std::max(epsilon, 1e-4f), std::max(epsilon, 1e-4f)});
        for (std::size_t i = 0; i < c.count; ++i)
          c.column[7][i] = float(std::pow(10.0, random.uniform(-44, 2)));
        for (Hat hat : kHats) {
          for (float w : weights_of<Way>(c.view(true), hat, {epsilon, epsilon})) {
            CHECK(w >= 0.0f);
            CHECK(w <= 1.0f + 1e-5f);
          }
        }
      }
    }
  });
}

template <class Way>
void check_facing_away() {
  Contacts c = contacts_of(Set::clump, std::min<std::size_t>(1200, Way::kMost), kRobust);
  for (std::size_t i = 0; i < c.count; ++i) c.column[6][i] = 0;
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats)
      for (float w : weights_of<Way>(c.view(true), hat, kRobust)) CHECK(w == 0.0f);
  });
}

template <class Way>
void check_not_numbers() {
  Contacts c = contacts_of(Set::walls, std::min<std::size_t>(3000, Way::kMost), kRobust);
  for (std::size_t i = 0; i < c.count; i += 13)
    c.column[i % 8][i] = i % 2 ? HUGE_VALF : std::numeric_limits<float>::quiet_NaN();
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) CHECK(weights_of<Way>(c.view(true), hat, kRobust).size() == c.count);
  });
}

}  // namespace h6::kernels::test
