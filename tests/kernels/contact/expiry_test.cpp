// SPDX-License-Identifier: Apache-2.0
// expiry_test.cpp - no point of a block travels farther than travel_blocks says, and what has
// expired is found, on every target.
#include "kernels/contact/expiry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr std::size_t kBlocks = 240, kReal = 231;  // the last rows fill a vector
constexpr double kVoxel = 0.4e-3, kRadius = 0.1, kMore = 1e-4;

struct Place {
  double m[3][4];  // from the shell [m] to voxels
};

// A turn by `angle` about an axis, and a shift [voxel].
Place place_of(const double (&axis)[3], double angle, const double (&shift)[3]) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double cross[3][3] = {
      {0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}};
  Place out{};
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 3; ++k)
      out.m[r][k] = ((r == k ? c : 0) + (1 - c) * axis[r] * axis[k] + s * cross[r][k]) / kVoxel;
    out.m[r][3] = shift[r];
  }
  return out;
}

// A shell that moved from one random place to another.
struct Moved {
  Place from, to;
  Motion motion{};
  Moved(Random& random, double angle, double way, bool settles) {
    double axis[3], shift[3], step[3];
    random.direction(axis);
    for (double& v : shift) v = random.uniform(-300, 300);
    for (int k = 0; k < 3; ++k) step[k] = shift[k] + random.uniform(-way, way);
    const double first = random.uniform(0, 3);
    from = place_of(axis, first, shift), to = place_of(axis, first + angle, step);
    double turn = 0, moved = 0;
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 4; ++k) {
        const double d = to.m[r][k] - from.m[r][k];
        motion.change.m[r][k] = float(d);
        (k < 3 ? turn : moved) += d * d;
      }
    motion.turn = float(std::sqrt(turn) * (1 + 1e-6));
    motion.most = float((std::sqrt(turn) * kRadius + std::sqrt(moved)) * (1 + 1e-6));
    motion.more = float(kMore + 4e-6 * motion.most);
    motion.settles = settles;
  }
};

struct Blocks {
  std::vector<float> x, y, z, radius, expiry;
  explicit Blocks(Random& random) : x(kBlocks), y(x), z(x), radius(x), expiry(kBlocks, HUGE_VALF) {
    for (std::size_t b = 0; b < kReal; ++b) {
      double to[3];
      random.direction(to);
      const double away = random.uniform(0, 0.08);
      x[b] = float(away * to[0]), y[b] = float(away * to[1]), z[b] = float(away * to[2]);
      radius[b] = float(random.uniform(0, kRadius - away));
      expiry[b] = float(random.uniform(0, 200));
    }
  }
  SpheresView view() const { return {x.data(), y.data(), z.data(), radius.data(), kBlocks}; }
};

struct Ways {
  std::vector<float> way, now, from;
  std::vector<std::uint32_t> open;
  explicit Ways(Random& random) : way(kBlocks), now(kBlocks), from(kBlocks), open(kBlocks) {
    for (float& w : way) w = float(random.uniform(0, 200));
  }
};

template <class F>
void travel(const F& kernel, const Blocks& blocks, const Motion& motion, Ways& w) {
  w.open.resize(kernel(blocks.view(), motion, blocks.expiry.data(), 0.25f, w.way.data(),
                       w.now.data(), w.from.data(), w.open.data()));
}

// How far a point of the sphere moved, in double.
double way_of_point(const Moved& moved, const Blocks& blocks, std::size_t b, Random& random) {
  double d[3];
  random.direction(d);
  const double p[3] = {blocks.x[b] + d[0] * blocks.radius[b], blocks.y[b] + d[1] * blocks.radius[b],
                       blocks.z[b] + d[2] * blocks.radius[b]};
  double square = 0;
  for (int r = 0; r < 3; ++r) {
    double v = moved.to.m[r][3] - moved.from.m[r][3];
    for (int k = 0; k < 3; ++k) v += (moved.to.m[r][k] - moved.from.m[r][k]) * p[k];
    square += v * v;
  }
  return std::sqrt(square);
}

}  // namespace

TEST_CASE("no point of a block moves farther than its way, which is no longer than it must be") {
  Random random(7);
  const Blocks blocks(random);
  on_every_target([&](const std::string&) {
    double shares = 0, count = 0;
    for (int round = 0; round < 60; ++round) {
      const Moved moved(random, std::pow(10, random.uniform(-9, 0)),
                        std::pow(10, random.uniform(-6, 1)), round % 2 == 0);
      Ways w(random);
      const std::vector<float> before = w.way;
      travel(travel_blocks, blocks, moved.motion, w);
      for (std::size_t b = 0; b < kReal; ++b) {
        double most = 0;
        for (int i = 0; i < 8; ++i) most = std::max(most, way_of_point(moved, blocks, b, random));
        const double ulp = moved.motion.settles ? 0 : 1.6e-5;  // of 200 in float
        CHECK(double{w.now[b]} - before[b] >= most - ulp);
        CHECK(double{w.from[b]} + (moved.motion.settles ? 0 : most) <= w.way[b] + ulp);
        CHECK(double{w.now[b]} - before[b] <= moved.motion.most + 1e-4);
        shares += most / (moved.motion.most + 1e-30), ++count;
        CHECK(w.way[b] == (moved.motion.settles ? w.now[b] : before[b]));
      }
      std::vector<std::uint32_t> open;
      for (std::uint32_t b = 0; b < kBlocks; ++b)
        if (blocks.expiry[b] <= w.now[b] + 0.25f) open.push_back(b);
      CHECK(w.open == open);
    }
    CHECK(shares / count < 0.8);  // else one way for the whole shell would do
  });
}

TEST_CASE("travel_blocks agrees with its specification on every target") {
  Random random(8);
  const Blocks blocks(random);
  on_every_target([&](const std::string&) {
    for (int round = 0; round < 40; ++round) {
      const Moved moved(random, std::pow(10, random.uniform(-9, 0)),
                        std::pow(10, random.uniform(-6, 1)), round % 2 == 0);
      Ways got(random), want = got;
      travel(travel_blocks, blocks, moved.motion, got);
      travel(travel_blocks_ref, blocks, moved.motion, want);
      for (std::size_t b = 0; b < kReal; ++b) {
        const float room = 4e-5f + 4e-6f * moved.motion.most;
        CHECK(std::fabs(got.now[b] - want.now[b]) <= room);
        CHECK(std::fabs(got.from[b] - want.from[b]) <= room);
        CHECK(std::fabs(got.way[b] - want.way[b]) <= room);
      }
    }
  });
}

TEST_CASE("a way of many small steps is never shorter than their sum") {
  Random random(9);
  Blocks blocks(random);
  Motion motion{};
  motion.change.m[0][3] = motion.most = 0.04f, motion.settles = true;
  on_every_target([&](const std::string&) {
    Ways w(random);
    std::fill(w.way.begin(), w.way.end(), 0.0f);
    for (int step = 1; step <= 6400; ++step) {
      travel(travel_blocks, blocks, motion, w);
      REQUIRE(double{w.way[0]} >= step * double{motion.most});
    }
    CHECK(w.way[0] < 6400 * 0.04 * 1.001);
  });
}

TEST_CASE("expiry: SIMD finds the same indices and the same least values on every target") {
  on_every_target([](const std::string&) {
    Random random(1);
    for (std::size_t blocks = 0; blocks <= 20; ++blocks) {
      std::vector<float> values(16 * blocks + 1);  // + 1: data() of an empty vector may be null
      std::vector<float> now(blocks + 1);
      for (float& v : values) v = float(random.uniform(0, 4));
      for (float& v : now) v = random.below(3) ? float(random.uniform(-1, 5)) : 1.5f;
      for (std::size_t i = 0; i < values.size(); i += 5) values[i] = 2;  // may be exactly now
      std::vector<std::uint32_t> some;
      for (std::uint32_t b = 0; b < blocks; b += 1 + random.below(3)) some.push_back(b);
      std::vector<std::uint32_t> got(16 * blocks + 1), want(16 * blocks + 1);
      const std::size_t n =
          expired_ref(values.data(), some.data(), some.size(), now.data(), 0.5f, want.data());
      CHECK(expired(values.data(), some.data(), some.size(), now.data(), 0.5f, got.data()) == n);
      CHECK(std::equal(want.begin(), want.begin() + n, got.begin()));
      std::vector<float> least(blocks + 1, -7), least_ref(blocks + 1, -7);
      least_of_blocks(values.data(), some.data(), some.size(), least.data());
      least_of_blocks_ref(values.data(), some.data(), some.size(), least_ref.data());
      CHECK(least == least_ref);
    }
  });
}
