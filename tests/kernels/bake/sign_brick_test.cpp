// SPDX-License-Identifier: Apache-2.0
// Samples of a brick: SIMD against the reference, and the contract of the samples.
#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

#include "kernels/bake/sign_brick.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;

namespace {

struct Brick {
  std::vector<float> u = std::vector<float>(512);
  std::uint64_t reached[8], in_sight[8];
  std::vector<Chain> chain = std::vector<Chain>(512);
  explicit Brick(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    for (float& v : u) v = float(random() % 160) / 32;  // many exactly on a limit
    for (std::uint64_t& m : reached) m = random() % 3 ? random() : random() % 2 - 1;
    for (std::uint64_t& m : in_sight) m = random() & random();
    for (Chain& c : chain) c = random() % 5 ? Chain(int(random() % 2000) - 400) : kChainFar;
  }
};

constexpr SignLimits kLimits{0.875f, 0.15f, 0.74f, 1.135f, 0.001f};

}  // namespace

TEST_CASE("sign_brick: every target says what the reference says, in place and apart") {
  on_every_target([](const std::string&) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      Brick brick(seed);
      const BrickSides sides{brick.reached, brick.in_sight, seed % 3 ? brick.chain.data() : nullptr,
                             seed % 2 == 0};
      std::vector<float> fast(513, 7.0f), exact(512);
      sign_brick(brick.u.data(), sides, kLimits, fast.data());
      sign_brick_ref(brick.u.data(), sides, kLimits, exact.data());
      CHECK(std::memcmp(fast.data(), exact.data(), 512 * sizeof(float)) == 0);
      CHECK(fast[512] == 7.0f);
      sign_brick(brick.u.data(), sides, kLimits, brick.u.data());
      CHECK(std::memcmp(brick.u.data(), exact.data(), 512 * sizeof(float)) == 0);
    }
  });
}

TEST_CASE("sign_brick: reached nodes tell their distance, the others are never outside") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Brick brick(seed);
    std::vector<float> out(512);
    sign_brick(brick.u.data(), {brick.reached, brick.in_sight, brick.chain.data(), true}, kLimits,
               out.data());
    for (std::size_t n = 0; n < 512; ++n) {
      if (brick.reached[n / 64] >> (n % 64) & 1)
        CHECK(out[n] == (brick.u[n] - kLimits.offset) * kLimits.voxel);
      else
        CHECK(out[n] <= 0);
    }
  }
}

TEST_CASE("sign_brick: a chain never makes a node behind a sheet less deep than the sheet does") {
  std::size_t deeper = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Brick brick(seed);
    std::vector<float> plain(512), chained(512);
    BrickSides sides{brick.reached, brick.in_sight, nullptr, true};
    sign_brick(brick.u.data(), sides, kLimits, plain.data());
    sides.chain = brick.chain.data();
    sign_brick(brick.u.data(), sides, kLimits, chained.data());
    for (std::size_t n = 0; n < 512; ++n) {
      if ((brick.reached[n / 64] | brick.in_sight[n / 64]) >> (n % 64) & 1) continue;
      CHECK(chained[n] <= plain[n]);
      deeper += chained[n] < plain[n];
    }
  }
  CHECK(deeper > 0);
}
