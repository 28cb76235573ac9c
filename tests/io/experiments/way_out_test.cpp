// SPDX-License-Identifier: Apache-2.0
// way_out_test.cpp - whether contacts have a common way out, and how far it is.
#include "io/experiments/forced/way_out.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace h6;
using namespace h6::cli;

namespace {

struct Touch {
  h6Vec3 normal, arm;
  double depth;
};

std::optional<double> way(const std::vector<Touch>& touches, double lever = 0.05) {
  std::vector<float> column[7];
  for (const Touch& t : touches) {
    const double row[7] = {t.normal.x, t.normal.y, t.normal.z, t.arm.x, t.arm.y, t.arm.z, t.depth};
    for (int k = 0; k < 7; ++k) column[k].push_back(static_cast<float>(row[k]));
  }
  h6Contacts c{};
  c.count = touches.size();
  c.nx = column[0].data(), c.ny = column[1].data(), c.nz = column[2].data();
  c.rx = column[3].data(), c.ry = column[4].data(), c.rz = column[5].data();
  c.depth = column[6].data();
  return way_out(c, lever);
}

}  // namespace

TEST_CASE("a floor is left by its depth, and without contacts there is nothing to leave") {
  CHECK(*way({}) == 0);
  CHECK(*way({{{0, 0, 1}, {0.01, 0, 0}, -1e-3}}) == 0);  // about to touch
  const std::optional<double> found =
      way({{{0, 0, 1}, {0.01, 0, 0}, 1e-3}, {{0, 0, 1}, {-0.01, 0, 0}, 1e-3}});
  REQUIRE(found);
  CHECK(*found == doctest::Approx(1e-3).epsilon(1e-3));
}

TEST_CASE("a wedge is left along its bisector, farther the narrower it is") {
  for (const double angle : {1.2, 0.6, 0.2, 0.05}) {  // of each wall against the way out
    const double s = std::sin(angle), c = std::cos(angle);
    const std::optional<double> found = way({{{c, 0, s}, {}, 1e-4}, {{-c, 0, s}, {}, 1e-4}});
    CAPTURE(angle);
    REQUIRE(found);
    CHECK(*found == doctest::Approx(1e-4 / s).epsilon(1e-2));
  }
}

TEST_CASE("walls that face each other with the body between them leave no way out") {
  CHECK_FALSE(way({{{1, 0, 0}, {}, 1e-4}, {{-1, 0, 0}, {}, 1e-4}}));
  CHECK_FALSE(way({{{1, 0, 0}, {}, 1e-4}, {{-1, 0, 0}, {}, 1e-6}}));
  // Three walls around, and a couple that is blocked both ways.
  const double c = std::cos(2.0944), s = std::sin(2.0944);
  CHECK_FALSE(way({{{1, 0, 0}, {}, 1e-4}, {{c, s, 0}, {}, 1e-4}, {{c, -s, 0}, {}, 1e-4}}));
  CHECK_FALSE(way({{{0, 0, 1}, {0.02, 0, 0}, 1e-4},
                   {{0, 0, -1}, {0.02, 0, 0}, 1e-4},
                   {{0, 0, 1}, {-0.02, 0, 0}, 1e-4}}));
}

TEST_CASE("opposing contacts at different arms are left by a turn") {
  const double depth = 1e-4, arm = 0.02, lever = 0.05;
  const std::optional<double> found =
      way({{{0, 0, 1}, {arm, 0, 0}, depth}, {{0, 0, -1}, {-arm, 0, 0}, depth}}, lever);
  REQUIRE(found);
  CHECK(*found == doctest::Approx(depth * lever / arm).epsilon(1e-3));
}
