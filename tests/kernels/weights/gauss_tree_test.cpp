// SPDX-License-Identifier: Apache-2.0
// gauss_tree_test.cpp - the tree gives the weights of the specification, at any number of contacts.
#include "kernels/weights/gauss_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <thread>
#include <vector>
#include "tests/kernels/weights/gauss_cases.h"
#include "tests/kernels/weights/gauss_sets.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Tree {
  static constexpr int kStages = kGaussStages;
  static constexpr std::size_t kMany = 9001, kMost = 70000;
  static constexpr auto bytes = gauss_tree_bytes;
  static constexpr auto all = gauss_weights_tree;
  static constexpr auto make = gauss_tree;
  static constexpr auto slices = gauss_tree_slices;
  static constexpr auto run = gauss_tree_run;
};

}  // namespace

TEST_CASE("gauss_tree: weights are those of the reference on every target, count and alignment") {
  check_counts<Tree>();
}

TEST_CASE("gauss_tree: weights are right however thousands of contacts lie") {
  check_thousands<Tree>();
}

TEST_CASE("gauss_tree: any order of slices, and any threads, give the same bits") {
  check_same_bits_on_any_thread<Tree>();
}

TEST_CASE("gauss_tree: coincident contacts share one contact's stiffness, whatever their number") {
  check_coincident<Tree>();
}

TEST_CASE("gauss_tree: weights stay within 0 and 1 at any depth and width") {
  check_bounds<Tree>();
}

TEST_CASE("gauss_tree: contacts that face away weigh nothing, were they all to") {
  check_facing_away<Tree>();
}

TEST_CASE("gauss_tree: columns that are not numbers do no harm outside the weights") {
  check_not_numbers<Tree>();
}

TEST_CASE("gauss_tree: weights are right where contacts lie so dense that leaves share a walk") {
  for (const bool weighted : {false, true}) {
    Contacts c = contacts_of(Set::clump, kGaussMany - 5, kPaper);
    const DirectionsView view = c.view(weighted);
    const std::vector<float> want = reference_of(view, Hat::normal, kPaper, 400);
    on_every_target([&](const std::string& target) {
      if (target == "SCALAR") return;  // slow, and tested by smaller counts
      CHECK(worst_of(weights_of<Tree>(view, Hat::normal, kPaper), want, 400) <= kTolerance);
    });
  }
}

TEST_CASE("gauss_tree: weights of equal contacts are right whether or not directions are unit") {
  for (const float off : {0.0f, 1e-6f, 1e-4f, 0.01f, 0.5f}) {
    for (Set set : {Set::clump, Set::walls, Set::two_clusters}) {
      Contacts c = contacts_of(set, 5003, kPaper);
      for (std::size_t i = 0; i < c.count; ++i)
        for (int k = 0; k < 6; ++k) c.column[k][i] *= 1 + off * static_cast<float>(i % 5);
      const DirectionsView view = c.view(false);
      for (const GaussWidths widths : {kPaper, GaussWidths{0.3f, 1.2f}}) {
        const std::vector<float> want = reference_of(view, Hat::sum, widths, 100);
        on_every_target([&](const std::string& target) {
          if (target == "SCALAR" && off > 1e-6f) return;  // slow
          CAPTURE(off);
          CAPTURE(static_cast<int>(set));
          CHECK(worst_of(weights_of<Tree>(view, Hat::sum, widths), want, 100) <= kTolerance);
        });
      }
    }
  }
}

TEST_CASE(
    "gauss_tree: weights of kGaussMany contacts over one sphere are at most 1.2 % too large") {
  for (Set set : {Set::clump, Set::walls, Set::spread}) {
    for (std::size_t n : {kGaussMany + 16, std::size_t{100003}}) {
      for (const bool weighted : {false, true}) {
        Contacts c = contacts_of(set, n, kPaper);
        const DirectionsView view = c.view(weighted);
        const std::size_t step = n / 150;
        const std::vector<float> want = reference_of(view, Hat::sum, kPaper, step);
        on_every_target([&](const std::string& target) {
          if (target == "SCALAR" && n > kGaussMany + 16) return;  // slow
          CAPTURE(static_cast<int>(set));
          CAPTURE(n);
          CAPTURE(weighted);
          const std::vector<float> got = weights_of<Tree>(view, Hat::sum, kPaper);
          bool fits = true;
          for (std::size_t i = 0; i < n; i += step)
            fits = fits && got[i] >= want[i] * (1 - kTolerance) && got[i] <= want[i] * 1.012;
          CHECK(fits);
        });
      }
    }
  }
}

TEST_CASE("gauss_tree: thousands at the edge of a contact's support never hide it") {
  // A ring as wide as the hat, `middle` widths about a lone contact.
  for (const double middle : {0.98, 1.0, 1.02}) {
    Contacts c(kGaussMany + 4001, 0);
    Random random(5);
    for (std::size_t i = 0; i < c.count; ++i) {
      const double angle = random.uniform(-M_PI, M_PI);
      const double way = i == 0 ? 0.0 : kPaper.normal * (middle + random.uniform(-0.02, 0.02));
      double normal[3] = {way * std::cos(angle), way * std::sin(angle), 1};
      make_unit(normal);
      c.set(i, normal, normal, 1, 1e-3);
    }
    const DirectionsView view = c.view(false);
    std::vector<float> want(c.count);
    gauss_weights_ref(view, Hat::normal, kPaper, 0, 1, want.data());
    on_every_target([&](const std::string&) {
      const float got = weights_of<Tree>(view, Hat::normal, kPaper)[0];
      CAPTURE(middle);
      CAPTURE(want[0]);
      CHECK(got >= want[0] * (1 - 1e-3f));
    });
  }
}
