// SPDX-License-Identifier: Apache-2.0
// gauss_weights_test.cpp - shares of stiffness on the Gauss map, by each way of summing them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/weights/gauss_few.h"
#include "kernels/weights/gauss_sweep.h"
#include "kernels/weights/gauss_tree.h"
#include "tests/kernels/weights/gauss_sets.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr std::size_t kFew = kGaussFew;

struct Way {
  const char* name;
  std::size_t most;  // contacts
  bool geodesic;
  std::size_t (*bytes)(std::size_t count, Hat hat);
  void (*run)(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
              float* weight);
};
const Way kWays[] = {
    {"few", kFew, true, [](std::size_t, Hat) { return std::size_t{0}; },
     [](const DirectionsView& c, Hat hat, const GaussWidths& widths, void*, float* weight) {
       gauss_weights_few(c, hat, widths, weight);
     }},
    {"sweep", 1000000, true, gauss_sweep_bytes, gauss_weights_sweep},
    {"tree", 1000000, false, gauss_tree_bytes, gauss_weights_tree},
};

// Runs body(weights) on every target for each way that takes n contacts.
template <class Body>
void on_every_way(std::size_t n, const Body& body) {
  on_every_target([&](const std::string&) {
    for (const Way& way : kWays) {
      if (n > way.most) continue;
      CAPTURE(way.name);
      body([&](const DirectionsView& c, Hat hat, const GaussWidths& widths) {
        return weights_in(way.bytes(c.count, hat), c, hat, widths, way.run);
      });
    }
  });
}

}  // namespace

TEST_CASE("gauss weights: the angle in place of the chord, on every target, count and alignment") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c = contacts_of(kSets[n % 8], n, kRobust, n % 5);
      for (const Way& way : kWays) {
        if (!way.geodesic) continue;
        CAPTURE(way.name);
        for (Hat hat : kHats)
          for (const GaussWidths& widths :
               {GaussWidths{0.05f, 1.0f, true}, GaussWidths{2.0f, 2.0f, true}}) {
            const DirectionsView view = c.view(n % 2 == 0);
            const auto got = weights_in(way.bytes(n, hat), view, hat, widths, way.run);
            CHECK(worst_of(got, reference_of(view, hat, widths)) <= kTolerance);
          }
      }
    }
  });
}

TEST_CASE("gauss weights: the angle in place of the chord, thousands of contacts") {
  for (Set set : kSets) {
    for (Hat hat : kHats) {
      GaussWidths widths = widths_of(hat);
      widths.geodesic = true;
      Contacts c = contacts_of(set, h6::test::repeated(2001, 301), widths, 3);
      const auto want = reference_of(c.view(true), hat, widths, 20);
      on_every_target([&](const std::string&) {
        const auto got = weights_in(gauss_sweep_bytes(c.count, hat), c.view(true), hat, widths,
                                    gauss_weights_sweep);
        CHECK(worst_of(got, want, 20) <= kTolerance);
      });
    }
  }
}

TEST_CASE("gauss weights: alignment of the columns changes no bit") {
  Contacts a = contacts_of(Set::walls, kFew, kRobust, 0);
  Contacts b = contacts_of(Set::walls, kFew, kRobust, 7);
  on_every_way(kFew, [&](const auto& weights) {
    for (Hat hat : kHats)
      CHECK(weights(a.view(true), hat, kRobust) == weights(b.view(true), hat, kRobust));
  });
}

TEST_CASE("gauss weights: a contact without a neighbour within the hat keeps its whole stiffness") {
  Random random(2);
  Contacts c(kFew, 2);
  for (std::size_t i = 0; i < c.count; ++i) {
    // Normals and torque directions a golden angle apart: no two within 0.01.
    const double z = 1 - (2 * i + 1.0) / c.count, r = std::sqrt(1 - z * z), a = 2.39996 * i;
    const double v[3] = {r * std::cos(a), r * std::sin(a), z};
    c.set(i, v, v, 1, random.uniform(1e-5, 1e-3));
  }
  on_every_way(c.count, [&](const auto& weights) {
    for (Hat hat : kHats)
      for (float w : weights(c.view(true), hat, kPaper))
        CHECK(w == h6::test::near(1.0).epsilon(1e-6));
  });
}

TEST_CASE("gauss weights: the product hat tells torque directions apart, the normal hat does not") {
  const double normal[3] = {0, 0, 1}, left[3] = {1, 0, 0}, right[3] = {-1, 0, 0};
  Contacts c(2, 0);
  c.set(0, normal, left, 1, 1e-3);
  c.set(1, normal, right, 1, 1e-3);
  on_every_way(c.count, [&](const auto& weights) {
    CHECK(weights(c.view(true), Hat::product, kRobust)[0] == h6::test::near(1.0));
    CHECK(weights(c.view(true), Hat::normal, kRobust)[0] == h6::test::near(0.5));
    // Eq. (10)-(12) as printed give 2 / (2 + 1).
    CHECK(weights(c.view(true), Hat::sum, kRobust)[0] == h6::test::near(2.0 / 3));
  });
}

TEST_CASE(
    "gauss weights: a contact that faces away or has no depth weighs nothing and takes nothing") {
  Contacts c = contacts_of(Set::walls, 64, kRobust, 1);
  Contacts kept(64, 0);
  std::size_t n = 0;
  std::vector<std::size_t> source;
  for (std::size_t i = 0; i < c.count; ++i) {
    if (c.column[6][i] == 0 || c.column[7][i] == 0) continue;
    for (int k = 0; k < 8; ++k) kept.column[k][n] = c.column[k][i];
    source.push_back(i);
    ++n;
  }
  REQUIRE(n < c.count);
  kept.count = n;
  on_every_way(c.count, [&](const auto& weights) {
    for (Hat hat : kHats) {
      const auto with = weights(c.view(true), hat, kRobust);
      const auto without = weights(kept.view(true), hat, kRobust);
      for (std::size_t i = 0; i < c.count; ++i)
        if (c.column[6][i] == 0 || c.column[7][i] == 0) CHECK(with[i] == 0.0f);
      for (std::size_t k = 0; k < n; ++k)
        CHECK(without[k] == h6::test::near(with[source[k]]).epsilon(kTolerance));
    }
  });
}

TEST_CASE("gauss weights: a contact that enters at depth 0 enters without a jump") {
  Contacts c = contacts_of(Set::walls, 40, kRobust);
  on_every_way(c.count, [&](const auto& weights) {
    const auto before = weights(c.view(true), Hat::product, kRobust);
    float& depth = c.column[7][5];
    REQUIRE(depth == 0.0f);
    depth = 1e-10f;
    const auto after = weights(c.view(true), Hat::product, kRobust);
    for (std::size_t i = 0; i < c.count; ++i)
      if (i != 5) CHECK(std::fabs(after[i] - before[i]) <= 1e-4f);
    CHECK(after[5] <= 1.0f);
    depth = 0;
  });
}

TEST_CASE("gauss weights: the order of the contacts does not matter") {
  const std::size_t n = kFew - 1;  // prime
  Contacts c = contacts_of(Set::walls, n, kRobust), turned(n, 3);
  const auto source = [&](std::size_t i) { return (i * 37 + 11) % n; };
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 8; ++k) turned.column[k][i] = c.column[k][source(i)];
  on_every_way(n, [&](const auto& weights) {
    for (Hat hat : kHats) {
      const auto a = weights(c.view(true), hat, kRobust);
      const auto b = weights(turned.view(true), hat, kRobust);
      for (std::size_t i = 0; i < n; ++i)
        CHECK(b[i] == h6::test::near(a[source(i)]).epsilon(kTolerance));
    }
  });
}
