// Chains of nodes: SIMD against the reference, and against the straight line.
#include <doctest/doctest.h>

#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

#include "kernels/chain_step.h"

using namespace h6::kernels;

namespace {

template <class F>
void on_every_target(F&& check) {
  for (std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    INFO("target " << hwy::TargetName(target));
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
}

Chain& node(ChainBrick& brick, int n) { return brick.v[n / 64 + 1][n / 8 % 8 + 1][n % 8 + 1]; }

}  // namespace

TEST_CASE("chain_step: every target says what the reference says") {
  on_every_target([] {
    std::mt19937_64 random(3);
    for (int i = 0; i < 40; ++i) {
      ChainBrick brick;
      for (auto& layer : brick.v)
        for (auto& line : layer)
          for (Chain& c : line) c = random() % 3 ? kChainFar : Chain(int(random() % 3000) - 1500);
      const ChainBrick before = brick;
      for (const int steps : {0, 1, 2, 3, 9}) {
        std::vector<Chain> fast(512), exact(512);
        chain_step(brick, steps, fast.data());
        chain_step_ref(brick, steps, exact.data());
        CHECK(fast == exact);
      }
      CHECK(std::memcmp(&before, &brick, sizeof brick) == 0);
    }
  });
}

TEST_CASE("chain_seeds: every target says what the reference says, never less than the truth") {
  on_every_target([] {
    std::mt19937_64 random(4);
    for (std::size_t lines = 0; lines <= 67; ++lines) {
      const std::size_t u_apart = lines % 3 == 0 ? 8 : 64, out_apart = lines % 2 == 0 ? 8 : 16;
      std::vector<float> u(u_apart * lines);
      std::vector<std::uint8_t> mask(lines);
      for (float& v : u) v = float(random() % 100000) * 1e-4f;
      for (std::uint8_t& m : mask) m = std::uint8_t(random() % 4 ? random() : random() % 2 * 255);
      std::vector<Chain> fast(out_apart * lines, 7), exact(out_apart * lines, 7);
      chain_seeds(u.data(), u_apart, mask.data(), lines, 0.9f, fast.data(), out_apart);
      chain_seeds_ref(u.data(), u_apart, mask.data(), lines, 0.9f, exact.data(), out_apart);
      CHECK(fast == exact);  // between the lines as well: nothing is written there
      for (std::size_t n = 0; n < 8 * lines; ++n)
        if (const Chain c = fast[n / 8 * out_apart + n % 8]; c != kChainFar)
          CHECK(c * kChainUnit >= 0.9f - u[n / 8 * u_apart + n % 8]);
    }
  });
}

TEST_CASE("chain_sides: every target says what the reference says, on the limits too") {
  on_every_target([] {
    std::mt19937_64 random(5);
    const ChainLimits limits{0.875f, 0.15f, 1.135f, 0.25f};
    std::size_t found[3] = {0, 0, 0};
    for (int i = 0; i < 40; ++i) {
      std::vector<Chain> chain(512);
      std::vector<float> u(512);
      for (Chain& c : chain) c = random() % 5 ? Chain(int(random() % 900) - 200) : kChainFar;
      for (float& v : u) v = float(random() % 96) / 32;  // many exactly on a limit
      ChainSides fast, exact;
      chain_sides(chain.data(), u.data(), limits, fast);
      chain_sides_ref(chain.data(), u.data(), limits, exact);
      for (std::size_t z = 0; z < 8; ++z) {
        CHECK(fast.in_sight[z] == exact.in_sight[z]);
        CHECK(fast.dented[z] == exact.dented[z]);
        CHECK(fast.close[z] == exact.close[z]);
        found[0] += exact.in_sight[z] != 0;
        found[1] += exact.dented[z] != 0;
        found[2] += exact.close[z] != 0;
      }
    }
    for (const std::size_t count : found) CHECK(count > 0);
  });
}

TEST_CASE("chain_step: steps from one node are at least the distance, at most 13.5 % more") {
  for (const int seed : {0, 73, 511, 292}) {
    ChainBrick brick;
    std::fill_n(&brick.v[0][0][0], sizeof brick.v / sizeof(Chain), kChainFar);
    node(brick, seed) = 0;
    std::vector<Chain> out(512);
    for (int step = 0; step < 8; ++step) {
      chain_step(brick, 1, out.data());
      for (int n = 0; n < 512; ++n) node(brick, n) = out[std::size_t(n)];
    }
    for (int n = 0; n < 512; ++n) {
      const double d[3] = {double(n % 8 - seed % 8), double(n / 8 % 8 - seed / 8 % 8),
                           double(n / 64 - seed / 64)};
      const double straight = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const double chain = double(out[std::size_t(n)]) * kChainUnit;
      CHECK(chain >= straight - 1e-9);
      CHECK(chain <= 1.135 * straight);
    }
  }
}
