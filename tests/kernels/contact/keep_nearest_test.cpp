// SPDX-License-Identifier: Apache-2.0
// The nearest of many points: SIMD against the reference, and the contract for ties and order.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/contact/keep_nearest.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;
using h6::kernels::test::Random;

namespace {

struct Points {
  std::vector<std::uint32_t> row;
  std::vector<float> column[4];
  // `steps` > 0: distances are whole multiples of 1 / steps, so that many are the same.
  Points(std::size_t count, int steps, std::uint64_t seed) : row(count) {
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) row[i] = std::uint32_t(7 * i + 3);
    for (auto& c : column) {
      c.resize(count);
      for (float& v : c) v = float(random.uniform(-1, 1));
    }
    if (steps > 0)
      for (float& d : column[0]) d = std::round(d * float(steps)) / float(steps);
  }
  Touching view() {
    return {row.data(), column[0].data(), column[1].data(), column[2].data(), column[3].data()};
  }
  bool operator==(const Points& other) const {
    return row == other.row && std::equal(column, column + 4, other.column);
  }
  void cut(std::size_t count) {
    row.resize(count);
    for (auto& c : column) c.resize(count);
  }
};

}  // namespace

TEST_CASE("nearest_limit: every target finds the k-th least that sorting finds") {
  on_every_target([](const std::string&) {
    for (std::size_t count = 1; count <= 67; ++count)
      for (const int steps : {0, 1, 8})
        for (const std::size_t k : {std::size_t{1}, (count + 1) / 2, count}) {
          Points p(count, steps, count);
          const NearestLimit fast = nearest_limit(p.column[0].data(), count, k),
                             exact = nearest_limit_ref(p.column[0].data(), count, k);
          CHECK(fast.limit == exact.limit);
          CHECK(fast.below == exact.below);
        }
    Points many(30000, 0, 1);
    for (const std::size_t k : {1, 11, 16384, 29999, 30000}) {
      const NearestLimit fast = nearest_limit(many.column[0].data(), 30000, k);
      CHECK(fast.limit == nearest_limit_ref(many.column[0].data(), 30000, k).limit);
      CHECK(fast.below == k - 1);
    }
  });
}

TEST_CASE("nearest_limit: infinite, huge, tiny and signed zero distances have their order") {
  on_every_target([](const std::string&) {
    const float inf = std::numeric_limits<float>::infinity();
    std::vector<float> d = {3e38f, -0.0f, 1e-42f, -1e-42f, 0.0f, -inf, inf, -3e38f};
    for (std::size_t k = 1; k <= d.size(); ++k) {
      const NearestLimit fast = nearest_limit(d.data(), d.size(), k),
                         exact = nearest_limit_ref(d.data(), d.size(), k);
      CHECK(fast.limit == exact.limit);
      CHECK(fast.below == exact.below);
    }
  });
}

TEST_CASE("keep_nearest: as many as were asked for, the first of equals, in their order") {
  on_every_target([](const std::string&) {
    for (std::size_t count = 1; count <= 67; ++count)
      for (const int steps : {0, 1, 6})
        for (const std::size_t k : {std::size_t{1}, (count + 1) / 2, count}) {
          Points fast(count, steps, 100 + count), exact = fast;
          const NearestLimit at = nearest_limit(fast.column[0].data(), count, k);
          std::size_t ties = k - at.below, left = ties;
          // In two ranges, as two pairs of bodies have them.
          const std::size_t middle = count / 3;
          std::size_t n =
              keep_nearest(fast.view(), fast.column[0].data(), 0, middle, at.limit, ties, 0);
          n += keep_nearest(fast.view(), fast.column[0].data(), middle, count, at.limit, ties, n);
          CHECK(n == k);
          CHECK(ties == 0);
          CHECK(keep_nearest_ref(exact.view(), exact.column[0].data(), 0, count, at.limit, left,
                                 0) == k);
          fast.cut(k), exact.cut(k);
          CHECK(fast == exact);
          CHECK(std::is_sorted(fast.row.begin(), fast.row.end()));
        }
  });
}

TEST_CASE("keep_nearest: a key of its own decides, and goes with its row") {
  on_every_target([](const std::string&) {
    for (std::size_t count = 1; count <= 67; ++count) {
      Points p(count, 0, 200 + count);
      std::vector<float> key(count);
      for (std::size_t i = 0; i < count; ++i) key[i] = -p.column[0][i];
      const std::size_t k = (count + 1) / 2;
      const NearestLimit at = nearest_limit(key.data(), count, k);
      std::size_t ties = k - at.below;
      REQUIRE(keep_nearest(p.view(), key.data(), 0, count, at.limit, ties, 0) == k);
      for (std::size_t i = 0; i < k; ++i) {
        CHECK(key[i] == -p.column[0][i]);
        CHECK(key[i] <= at.limit);
      }
    }
  });
}
