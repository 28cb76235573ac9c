// gauss_tree_test.cpp - the tree gives the weights of the specification, at any number of contacts.
#include "kernels/gauss_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "tests/kernels/gauss_sets.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

std::vector<float> weights(const DirectionsView& c, Hat hat, const GaussWidths& widths) {
  return weights_in(gauss_tree_bytes(c.count, hat), c, hat, widths, gauss_weights_tree);
}

double worst_error(Contacts& c, Hat hat, const GaussWidths& widths, bool weighted,
                   std::size_t step = 1) {
  const DirectionsView view = c.view(weighted);
  return worst_of(weights(view, hat, widths), view, hat, widths, step);
}

}  // namespace

TEST_CASE("gauss_tree: weights are those of the reference on every target, count and alignment") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c = contacts_of(kSets[n % 8], n, kRobust, n % 5);
      for (Hat hat : kHats) {
        CHECK(worst_error(c, hat, kRobust, true) <= kTolerance);
        CHECK(worst_error(c, hat, kPaper, n % 2 == 0) <= kTolerance);
        CHECK(worst_error(c, hat, {2.0f, 2.0f}, n % 2 == 1) <= kTolerance);
      }
    }
  });
}

TEST_CASE("gauss_tree: weights are right however thousands of contacts lie") {
  on_every_target([](const std::string& target) {
    for (Set set : kSets) {
      for (Hat hat : kHats) {
        // The scalar target computes what the others do, slowly.
        for (std::size_t n : {1000, 5003, 20000}) {
          if (target == "SCALAR" && n > 5003) continue;
          CAPTURE(static_cast<int>(set));
          CAPTURE(static_cast<int>(hat));
          CAPTURE(n);
          const GaussWidths width = widths_of(hat);
          Contacts c = contacts_of(set, n, width, 3);
          CHECK(worst_error(c, hat, width, n != 1000 || hat == Hat::product, n / 40) <= kTolerance);
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: any order of slices, and any threads, give the same bits") {
  for (Hat hat : kHats) {
    Contacts c = contacts_of(Set::walls, 6001, widths_of(hat));
    const std::vector<float> want = weights(c.view(true), hat, widths_of(hat));
    std::vector<float> got(c.count);
    std::vector<char> memory(gauss_tree_bytes(c.count, hat));
    const GaussTree tree = gauss_tree(c.view(true), hat, widths_of(hat), memory.data(), got.data());
    for (const bool threads : {false, true}) {
      std::fill(got.begin(), got.end(), -1.0f);
      for (int stage = 0; stage < kGaussStages; ++stage) {
        const std::size_t slices = gauss_tree_slices(tree, stage);
        const auto odd = [&](std::size_t rest) {
          for (std::size_t i = slices; i-- > 0;)
            if (i % 2 == rest) gauss_tree_run(tree, stage, i);
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

TEST_CASE("gauss_tree: coincident contacts share one contact's stiffness, whatever their number") {
  on_every_target([](const std::string&) {
    for (std::size_t n : {1u, 17u, 1000u, 70000u}) {
      for (Hat hat : kHats) {
        Contacts c = contacts_of(Set::equal, n, kRobust);
        for (std::size_t i = 0; i < n; ++i) c.column[6][i] = 1, c.column[7][i] = 1e-3f;
        for (const bool weighted : {false, true}) {
          const auto w = weights(c.view(weighted), hat, kRobust);
          CHECK(std::accumulate(w.begin(), w.end(), 0.0) == h6::test::near(1.0).epsilon(1e-5));
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: weights stay within 0 and 1 at any depth and width") {
  Random random(77);
  on_every_target([&](const std::string&) {
    for (float epsilon : {1e-30f, 1e-4f, 0.01f, 2.0f}) {
      for (Set set : {Set::clump, Set::spread, Set::equal}) {
        Contacts c = contacts_of(set, 700, {std::max(epsilon, 1e-4f), std::max(epsilon, 1e-4f)});
        for (std::size_t i = 0; i < c.count; ++i)
          c.column[7][i] = float(std::pow(10.0, random.uniform(-44, 2)));
        for (Hat hat : kHats) {
          for (float w : weights(c.view(true), hat, {epsilon, epsilon})) {
            CHECK(w >= 0.0f);
            CHECK(w <= 1.0f + 1e-5f);
          }
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: contacts that face away weigh nothing, were they all to") {
  Contacts c = contacts_of(Set::clump, 1200, kRobust);
  for (std::size_t i = 0; i < c.count; ++i) c.column[6][i] = 0;
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats)
      for (float w : weights(c.view(true), hat, kRobust)) CHECK(w == 0.0f);
  });
}

TEST_CASE("gauss_tree: columns that are not numbers do no harm outside the weights") {
  Contacts c = contacts_of(Set::walls, 3000, kRobust);
  for (std::size_t i = 0; i < c.count; i += 13)
    c.column[i % 8][i] = i % 2 ? HUGE_VALF : std::numeric_limits<float>::quiet_NaN();
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) CHECK(weights(c.view(true), hat, kRobust).size() == c.count);
  });
}
