// SPDX-License-Identifier: Apache-2.0
// How a part stands to its environment: distances, containment and ways out that are known.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "io/propose/free_way.h"
#include "io/scenes/shapes.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6;
using namespace h6::io;

namespace {

std::unique_ptr<FreeWay> between(const Mesh& part, const Mesh& others) {
  auto way = FreeWay::make(part, others, 2);
  REQUIRE(way);
  return std::move(*way);
}

bool close(double a, double b, double tolerance) { return std::fabs(a - b) <= tolerance; }

}  // namespace

TEST_CASE("two boxes are as far apart as they are, and the nearest places lie on both") {
  const auto way = between(box({0, 0, 0}, {1, 1, 1}), box({3, 0, 0}, {4, 1, 1}));
  const FreeWay::Nearest n = way->nearest({});
  CHECK(close(n.distance, 2, 1e-9));
  CHECK(close(n.from.x, 1, 1e-9));
  CHECK(close(n.to.x, 3, 1e-9));
  CHECK(close(way->nearest({1.5, 0, 0}).distance, 0.5, 1e-9));
  CHECK(way->inside({}) == 0);
}

TEST_CASE("a part inside another, and one around another, lie inside") {
  const Mesh small = box({0, 0, 0}, {1, 1, 1}), large = box({-5, -5, -5}, {5, 5, 5});
  CHECK(between(small, large)->inside({}) == 1);
  CHECK(between(large, small)->inside({}) == 1);
  CHECK(between(small, large)->inside({20, 0, 0}) == 0);
  // A face that touches is not inside.
  CHECK(between(small, box({1, 0, 0}, {2, 1, 1}))->inside({}) == 0);
}

TEST_CASE("a peg leaves its hole along the axis at once, sideways only past the wall") {
  // A peg 40 mm long stands 20 mm deep in a hole of the block |x|, |y| <= 20 mm.
  const Mesh block = block_with_hole(20 * kMm, 30 * kMm, 5.2 * kMm, 20 * kMm, 64);
  const Mesh peg = box({-3.5 * kMm, -3.5 * kMm, -19.5 * kMm}, {3.5 * kMm, 3.5 * kMm, 20 * kMm});
  const auto way = between(peg, block);
  CHECK(way->inside({}) == 0);
  CHECK(way->way_out({0, 0, 1}) == 0);
  CHECK(close(way->way_out({1, 0, 0}), 23.5 * kMm, 0.3 * kMm));
  CHECK(way->way_out({0, 0, -1}) > 30 * kMm);
}

TEST_CASE("the way out of an overlap ends where the last of the other is passed") {
  // A box of side 2 sunk by 0.25 into a floor with a wall behind it.
  Mesh floor = box({-10, -10, -1}, {10, 10, 0});
  const auto way = between(box({-1, -1, -0.25}, {1, 1, 1.75}), floor);
  CHECK(way->inside({}) > 0.1);
  CHECK(close(way->way_out({0, 0, 1}), 0.25, 1e-6));
  CHECK(close(way->way_out({1, 0, 0}), 11, 0.3));
}
