// SPDX-License-Identifier: Apache-2.0
// gauss_few_test.cpp - every pair once gives the weights of the specification.
#include "kernels/weights/gauss_few.h"

#include "tests/kernels/weights/gauss_cases.h"
#include "tests/kernels/weights/gauss_sets.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Few {
  static constexpr std::size_t kMost = kGaussFew;
  static std::size_t bytes(std::size_t, Hat) { return 0; }
  static void all(const DirectionsView& c, Hat hat, const GaussWidths& widths, void*,
                  float* weight) {
    gauss_weights_few(c, hat, widths, weight);
  }
};

}  // namespace

TEST_CASE("gauss_few: weights are those of the reference on every target, count and alignment") {
  check_counts<Few>();
}

TEST_CASE("gauss_few: weights are right however contacts lie, up to the most that it takes") {
  on_every_target([](const std::string&) {
    for (Set set : kSets) {
      for (Hat hat : kHats) {
        for (const std::size_t n : {std::size_t{100}, kGaussFew - 1, kGaussFew}) {
          CAPTURE(static_cast<int>(set));
          CAPTURE(static_cast<int>(hat));
          Contacts c = contacts_of(set, n, widths_of(hat), n % 3);
          CHECK(worst_error<Few>(c, hat, widths_of(hat), true) <= kTolerance);
          CHECK(worst_error<Few>(c, hat, widths_of(hat), false) <= kTolerance);
        }
      }
    }
  });
}

TEST_CASE("gauss_few: coincident contacts share one contact's stiffness, whatever their number") {
  check_coincident<Few>();
}

TEST_CASE("gauss_few: weights stay within 0 and 1 at any depth and width") { check_bounds<Few>(); }

TEST_CASE("gauss_few: contacts that face away weigh nothing, were they all to") {
  check_facing_away<Few>();
}

TEST_CASE("gauss_few: columns that are not numbers do no harm outside the weights") {
  check_not_numbers<Few>();
}
