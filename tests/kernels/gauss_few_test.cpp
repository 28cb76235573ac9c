// gauss_few_test.cpp - every pair once gives the weights of the specification.
#include "kernels/gauss_few.h"

#include "tests/kernels/gauss_cases.h"
#include "tests/kernels/gauss_sets.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Few {
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
  on_every_target([](const std::string&) {
    for (const std::size_t n : {1, 3, 17, 48, 49, 128}) {
      for (Hat hat : kHats) {
        Contacts c = contacts_of(Set::equal, n, kRobust);
        for (std::size_t i = 0; i < n; ++i) c.column[6][i] = 1, c.column[7][i] = 1e-3f;
        for (const bool weighted : {false, true}) {
          const auto w = weights_of<Few>(c.view(weighted), hat, kRobust);
          CHECK(std::accumulate(w.begin(), w.end(), 0.0) == h6::test::near(1.0).epsilon(1e-5));
        }
      }
    }
  });
}

TEST_CASE("gauss_few: weights stay within 0 and 1 at any depth and width, and where none weighs") {
  Random random(77);
  on_every_target([&](const std::string&) {
    for (float epsilon : {1e-30f, 1e-4f, 0.01f, 2.0f}) {
      for (Set set : {Set::clump, Set::spread, Set::equal}) {
        Contacts c = contacts_of(set, 90, {std::max(epsilon, 1e-4f), std::max(epsilon, 1e-4f)});
        for (std::size_t i = 0; i < c.count; ++i)
          c.column[7][i] = float(std::pow(10.0, random.uniform(-44, 2)));
        for (Hat hat : kHats) {
          for (float w : weights_of<Few>(c.view(true), hat, {epsilon, epsilon})) {
            CHECK(w >= 0.0f);
            CHECK(w <= 1.0f + 1e-5f);
          }
        }
        for (std::size_t i = 0; i < c.count; ++i) c.column[6][i] = 0;
        for (Hat hat : kHats)
          for (float w : weights_of<Few>(c.view(true), hat, {epsilon, epsilon})) CHECK(w == 0.0f);
      }
    }
  });
}
