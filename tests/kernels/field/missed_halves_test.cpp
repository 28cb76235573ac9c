// SPDX-License-Identifier: Apache-2.0
// Where interpolation misses, on every target as the specification says.
#include "kernels/field/missed_halves.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;
using h6::kernels::test::Random;

namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

float plane(double x, double y, double z) { return float(0.3 * x - 0.5 * y + 0.2 * z - 1); }

std::vector<float> plane_at(int side, int step) {
  std::vector<float> out;
  for (int n = 0; n < side * side * side; ++n)
    out.push_back(plane(step * (n % side), step * (n / side % side), step * (n / side / side)));
  return out;
}

}  // namespace

TEST_CASE("missed_halves: as the specification says, with unknown nodes, on every target") {
  on_every_target([](const std::string&) {
    Random random(5);
    std::size_t some = 0;
    for (int trial = 0; trial < 2000; ++trial) {
      const std::size_t cells = trial % 2 == 0 ? 2 : 4;
      std::vector<float> corners = plane_at(int(cells) + 1, 8 / int(cells)), exact = plane_at(9, 1);
      exact.resize(kMissedBoxRoom + 1, 9.0f);  // what lies beyond the box does not count
      for (int k = 0; k < 3; ++k) {
        exact[random.below(kMissedBox)] += float(random.uniform(-0.2, 0.2));
        corners[random.below(corners.size())] += float(random.uniform(-0.2, 0.2));
      }
      if (trial % 3 == 0) exact[random.below(kMissedBox)] = kUnknown;
      if (trial % 5 == 0) corners[random.below(corners.size())] = kUnknown;
      const float tested = float(random.uniform(0, 4));
      const unsigned found = missed_halves(corners.data(), cells, exact.data(), 0.1f, tested);
      CHECK(found == missed_halves_ref(corners.data(), cells, exact.data(), 0.1f, tested));
      some += found != 0 && found != 255;
    }
    CHECK(some > 200);
  });
}

TEST_CASE("missed_halves: a node misses in all halves that it is a part of, and only if tested") {
  on_every_target([](const std::string&) {
    const std::vector<float> corners = plane_at(3, 4);
    const auto missed = [&](int x, int y, int z, float by, float tested) {
      std::vector<float> exact = plane_at(9, 1);
      exact.resize(kMissedBoxRoom);
      exact[std::size_t(81 * z + 9 * y + x)] += by;
      return missed_halves(corners.data(), 2, exact.data(), 0.1f, tested);
    };
    CHECK(missed(1, 2, 3, 0.0f, 100) == 0);
    CHECK(missed(1, 2, 3, 0.05f, 100) == 0);
    CHECK(missed(1, 2, 3, 0.2f, 100) == 1);
    CHECK(missed(5, 2, 3, -0.2f, 100) == 2);
    CHECK(missed(4, 2, 3, 0.2f, 100) == 3);
    CHECK(missed(4, 4, 4, 0.2f, 100) == 255);
    CHECK(missed(8, 8, 8, 0.2f, 100) == 128);
    CHECK(missed(8, 8, 8, 0.2f, 0.5f) == 0);
    CHECK(missed(1, 2, 3, kUnknown, 100) == 0);
  });
}
