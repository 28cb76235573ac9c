// SPDX-License-Identifier: Apache-2.0
// Exact distances of a brick's nodes to triangles: SIMD against the reference, and against
// geometry.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "kernels/bake/triangle_distance.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;

namespace {

struct Random {
  std::mt19937_64 engine{7};
  double operator()(double low, double high) {
    return low + (high - low) * double(engine() >> 11) * 0x1p-53;
  }
};

using Triangles = std::vector<double>;  // 9 a triangle

Triangles random_triangles(std::size_t count, double size, Random& random) {
  Triangles t;
  for (std::size_t i = 0; i < count; ++i) {
    double middle[3];
    for (double& m : middle) m = random(-4, 12);
    for (int corner = 0; corner < 3; ++corner)
      for (double m : middle) t.push_back(m + random(-size, size));
  }
  return t;
}

double worst_gap(const Triangles& t, float reach) {
  std::vector<float> fast(kBrickSamples, -1.0f), exact(kBrickSamples, -2.0f);
  triangle_distance(t.data(), t.size() / 9, reach, fast.data());
  triangle_distance_ref(t.data(), t.size() / 9, reach, exact.data());
  double worst = 0;
  for (std::size_t n = 0; n < kBrickSamples; ++n)
    worst = std::max(worst, std::fabs(double(fast[n]) - exact[n]));
  return worst;
}

}  // namespace

TEST_CASE("triangle_distance: SIMD agrees with the reference on every target, for every count") {
  on_every_target([](const std::string&) {
    Random random;
    for (std::size_t count = 0; count <= 67; ++count)
      CHECK(worst_gap(random_triangles(count, 2.0, random), 5.0f) < 2e-5);
    for (double size : {1e-5, 1e-3, 0.1, 10.0, 50.0})
      CHECK(worst_gap(random_triangles(20, size, random), 40.0f) < 1e-4);
  });
}

TEST_CASE("triangle_distance: slivers, needles and points count as what is left of them") {
  on_every_target([](const std::string&) {
    Random random;
    for (double width : {0.0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2}) {
      Triangles t;
      for (int i = 0; i < 10; ++i) {
        double a[3], b[3];
        for (int k = 0; k < 3; ++k) a[k] = random(-30, 38), b[k] = random(-30, 38);
        t.insert(t.end(), a, a + 3);
        t.insert(t.end(), b, b + 3);
        const double s = random(0, 1);
        for (int k = 0; k < 3; ++k) t.push_back(a[k] + s * (b[k] - a[k]) + random(-width, width));
      }
      INFO("width " << width);
      CHECK(worst_gap(t, 60.0f) < 1e-4);
    }
    const Triangles point = {3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5};
    CHECK(worst_gap(point, 20.0f) < 1e-6);
  });
}

TEST_CASE("make_distance_facets: the same bits as one triangle at a time, without area too") {
  on_every_target([](const std::string&) {
    Random random;
    for (std::size_t count = 0; count <= 21; ++count) {
      Triangles t = random_triangles(count, 20.0, random);
      for (std::size_t i = 0; i < count; i += 5) {  // a line
        double* c = t.data() + 9 * i;
        for (std::size_t k = 0; k < 3; ++k) c[6 + k] = 3 * c[k] - 2 * c[3 + k];
      }
      for (std::size_t i = 3; i < count; i += 7)  // a point
        for (std::size_t k = 3; k < 9; ++k) t[9 * i + k] = t[9 * i + k % 3];
      std::vector<DistanceFacet> many(count + 1);
      many[count].half[0] = -7;
      make_distance_facets(t.data(), count, many.data());
      for (std::size_t i = 0; i < count; ++i) {
        const DistanceFacet one = make_distance_facet(t.data() + 9 * i);
        CHECK(std::memcmp(&one, &many[i], sizeof one) == 0);
      }
      CHECK(many[count].half[0] == -7);  // and no further
    }
  });
}

TEST_CASE("triangle_distance: a node on a corner, an edge or the face is at distance zero") {
  const Triangles t = {0, 0, 3, 7, 0, 3, 0, 7, 3};
  std::vector<float> distance(kBrickSamples);
  triangle_distance(t.data(), 1, 9.0f, distance.data());
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t x = 0; x + y < 8; ++x) CHECK(distance[(3 * 8 + y) * 8 + x] == 0.0f);
  CHECK(distance[(7 * 8 + 2) * 8 + 2] == h6::test::near(4.0));
  CHECK(distance[(3 * 8 + 7) * 8 + 7] == h6::test::near(7.0 / std::sqrt(2.0)));
}

TEST_CASE("triangle_distance: beyond the reach it says the reach") {
  const Triangles t = {-50, 0, 0, -50, 1, 0, -50, 0, 1};
  std::vector<float> distance(kBrickSamples);
  triangle_distance(t.data(), 1, 6.0f, distance.data());
  CHECK(std::all_of(distance.begin(), distance.end(), [](float v) { return v == 6.0f; }));
  triangle_distance(nullptr, 0, 2.5f, distance.data());
  CHECK(std::all_of(distance.begin(), distance.end(), [](float v) { return v == 2.5f; }));
}

TEST_CASE("triangle_distance: the winding and the first corner do not matter") {
  Random random;
  for (int i = 0; i < 50; ++i) {
    Triangles t = random_triangles(1, 6.0, random), turned(t.begin() + 3, t.end()), flipped = t;
    turned.insert(turned.end(), t.begin(), t.begin() + 3);
    std::swap_ranges(flipped.begin(), flipped.begin() + 3, flipped.begin() + 3);
    std::vector<float> d0(kBrickSamples), d1(kBrickSamples), d2(kBrickSamples);
    triangle_distance(t.data(), 1, 30.0f, d0.data());
    triangle_distance(turned.data(), 1, 30.0f, d1.data());
    triangle_distance(flipped.data(), 1, 30.0f, d2.data());
    for (std::size_t n = 0; n < kBrickSamples; ++n) {
      CHECK(std::fabs(d0[n] - d1[n]) < 1e-5);
      CHECK(std::fabs(d0[n] - d2[n]) < 1e-5);
    }
  }
}

TEST_CASE(
    "tile_distance: the order of the facets does not change a bit, nor a brick's place much") {
  on_every_target([](const std::string&) {
    Random random;
    const Triangles t = random_triangles(60, 3.0, random);
    std::vector<DistanceFacet> up(60), down(60);
    std::vector<std::int32_t> names(60), turned(60);
    const std::vector<FacetRegion> regions(60);
    for (std::size_t i = 0; i < 60; ++i) {
      up[i] = down[59 - i] = make_distance_facet(t.data() + 9 * i);
      names[i] = turned[59 - i] = std::int32_t(i);
    }
    constexpr int kBricks[] = {0, 1 + 16, 3 + 16, 63};
    std::uint64_t bricks = 0;
    for (int b : kBricks) bricks |= std::uint64_t{1} << b;
    const std::vector<std::uint64_t> near(60, bricks);
    const auto one = std::make_unique<TileRoom>(), other = std::make_unique<TileRoom>();
    tile_distance(up.data(), regions.data(), near.data(), names.data(), 60, 20.0f, *one);
    tile_distance(down.data(), regions.data(), near.data(), turned.data(), 60, 20.0f, *other);
    for (int brick : kBricks) {
      std::vector<float> a(kBrickSamples), b(kBrickSamples), exact(kBrickSamples);
      brick_distance(*one, std::size_t(brick), a.data());
      brick_distance(*other, std::size_t(brick), b.data());
      CHECK(a == b);
      CHECK(one->nearest[brick] == other->nearest[brick]);
      const double origin[3] = {8.0 * (brick % 4), 8.0 * (brick / 4 % 4), 8.0 * (brick / 16)};
      Triangles there = t;
      for (std::size_t i = 0; i < there.size(); ++i) there[i] -= origin[i % 3];
      triangle_distance_ref(there.data(), 60, 20.0f, exact.data());
      for (std::size_t n = 0; n < kBrickSamples; ++n) CHECK(std::fabs(a[n] - exact[n]) < 3e-5);
    }
  });
}

TEST_CASE(
    "tile_distance: a brick's name is that of the facet nearest to its middle, the least of "
    "equals") {
  on_every_target([](const std::string&) {
    Random random;
    constexpr std::size_t kCount = 40;
    Triangles t = random_triangles(kCount, 3.0, random);
    for (double& c : t) c = 2 * c + 8;
    std::vector<DistanceFacet> facets;
    std::vector<std::int32_t> names;
    for (int copy = 0; copy < 2; ++copy)
      for (std::size_t i = 0; i < kCount; ++i) {
        facets.push_back(make_distance_facet(t.data() + 9 * i));
        names.push_back(std::int32_t(copy == 0 ? 100 + i : i));
      }
    const std::vector<FacetRegion> regions(2 * kCount);
    const std::vector<std::uint64_t> near(2 * kCount, ~std::uint64_t{0});
    const auto room = std::make_unique<TileRoom>();
    tile_distance(facets.data(), regions.data(), near.data(), names.data(), facets.size(), 6.0f,
                  *room);
    for (std::size_t b = 0; b < 64; ++b) {
      const double p[3] = {8.0 * double(b % 4) + 3.5, 8.0 * double(b / 4 % 4) + 3.5,
                           8.0 * double(b / 16) + 3.5};
      double least = 1e300;
      for (std::size_t i = 0; i < kCount; ++i) {
        const double* c = t.data() + 9 * i;
        least = std::min(least, point_triangle_squared(p, c, c + 3, c + 6));
      }
      REQUIRE(room->nearest[b] < std::int32_t(kCount));
      const double* c = t.data() + 9 * room->nearest[b];
      CHECK(std::sqrt(point_triangle_squared(p, c, c + 3, c + 6)) < std::sqrt(least) + 1e-4);
    }
    tile_distance(facets.data(), regions.data(), near.data(), names.data(), 0, 6.0f, *room);
    CHECK(std::all_of(room->nearest, room->nearest + 64, [](auto n) { return n == kNobody; }));
  });
}

TEST_CASE("bricks_within_reach: never misses a brick that has a node within reach") {
  on_every_target([](const std::string&) {
    Random random;
    std::size_t named = 0, real = 0;
    for (int i = 0; i < 60; ++i) {
      Triangles t = random_triangles(1, i % 2 ? 3.0 : 15.0, random);
      for (double& c : t) c = 2.5 * c + 6;
      const std::array<float, 3> first = {float(random(-90, 90)), 32, -64};
      Triangles seen = t;
      for (std::size_t k = 0; k < 9; ++k) seen[k] += double(first[k % 3]);
      const std::uint64_t near =
          bricks_within_reach(make_distance_facet(seen.data()), first.data(), 5.0f);
      for (int b = 0; b < 64; ++b) {
        Triangles there = t;
        const double at[3] = {8.0 * (b % 4), 8.0 * (b / 4 % 4), 8.0 * (b / 16)};
        for (std::size_t k = 0; k < 9; ++k) there[k] -= at[k % 3];
        std::vector<float> exact(kBrickSamples);
        triangle_distance_ref(there.data(), 1, 5.0f, exact.data());
        const bool within = *std::min_element(exact.begin(), exact.end()) < 5.0f;
        if (within) CHECK((near >> b & 1) == 1);
        real += within;
        named += near >> b & 1;
      }
    }
    CHECK(real > 100);
    CHECK(double(named) < 1.3 * double(real));  // and seldom names one that has none
  });
}

TEST_CASE("nodes_above: a bit for each node that is farther, the level itself is not") {
  on_every_target([](const std::string&) {
    Random random;
    std::vector<float> u(kBrickSamples);
    for (std::size_t n = 0; n < u.size(); ++n) u[n] = n % 5 == 0 ? 0.75f : float(random(0, 1.5));
    std::uint64_t fast[8], exact[8];
    nodes_above(u.data(), 0.75f, fast);
    nodes_above_ref(u.data(), 0.75f, exact);
    for (int z = 0; z < 8; ++z) CHECK(fast[z] == exact[z]);
  });
}
