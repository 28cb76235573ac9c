// SPDX-License-Identifier: Apache-2.0
// Chains of nodes: SIMD against the reference, and against the straight line.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "kernels/bake/chain_step.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;

namespace {

// A brick and the nodes around it, at some strides.
struct Room {
  std::size_t line, layer;
  std::vector<Chain> v;
  Room(std::size_t line, std::size_t layer) : line(line), layer(layer), v(10 * layer, kChainFar) {}
  std::size_t at(int n) const {
    return std::size_t(n / 64 + 1) * layer + std::size_t(n / 8 % 8 + 1) * line +
           std::size_t(n % 8 + 1);
  }
  Chain* first() { return v.data() + at(0); }
};

}  // namespace

TEST_CASE("chain_step: every target says what the reference says, in place and apart") {
  on_every_target([](const std::string&) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 60; ++i) {
      Room room(10 + std::size_t(i) % 7, 200 + std::size_t(i) % 5);
      const unsigned far = i % 4 == 3 ? 60 : 3;
      for (Chain& c : room.v) c = random() % far ? kChainFar : Chain(int(random() % 3000) - 1500);
      Room in_place = room;
      for (int step = 0; step < 9; ++step) {
        std::vector<Chain> exact(512), fast(10 * 9 + 80 * 8, 7);
        const bool changed =
            chain_step_ref(room.first(), room.line, room.layer, exact.data(), 8, 64);
        const std::vector<Chain> before = room.v;
        CHECK(chain_step(room.first(), room.line, room.layer, fast.data(), 9, 80) == changed);
        CHECK(room.v == before);
        CHECK(chain_step(in_place.first(), room.line, room.layer, in_place.first(), room.line,
                         room.layer) == changed);
        bool same = true;
        for (int n = 0; n < 512; ++n) {
          room.v[room.at(n)] = exact[std::size_t(n)];
          same &=
              fast[std::size_t(80 * (n / 64) + 9 * (n / 8 % 8) + n % 8)] == exact[std::size_t(n)];
        }
        CHECK(same);
        CHECK(in_place.v == room.v);  // around the brick as well: nothing is written there
        for (std::size_t y = 0; y < 8; ++y) CHECK(fast[9 * y + 8] == 7);
      }
    }
  });
}

TEST_CASE("chain_step: it tells when nothing changes any more") {
  Room room(16, 160);
  room.v[room.at(100)] = 0;
  int steps = 0;
  while (chain_step(room.first(), 16, 160, room.first(), 16, 160)) REQUIRE(++steps < 20);
  CHECK(steps == 6);  // node (4,4,1) to the layer z = 7
}

TEST_CASE("chain_seeds: every target says what the reference says, never less than the truth") {
  on_every_target([](const std::string&) {
    std::mt19937_64 random(4);
    for (int i = 0; i < 60; ++i) {
      const ChainSeeds seeds{0.9f, i % 2 == 1, i % 3 == 0 ? 1 : 8, i % 5 == 0 ? 1 : 8};
      const std::size_t line = i % 7 == 0 ? 8 : 48, layer = line * 9;
      std::vector<float> u(512);
      std::uint64_t mask[8];
      for (float& v : u) v = float(random() % 100000) * 1e-4f;
      for (std::uint64_t& m : mask) m = random() % 4 ? random() & random() >> 7 : random() % 2 - 1;
      std::vector<Chain> fast(8 * layer, 7), exact(8 * layer, 7);
      chain_seeds(u.data(), mask, seeds, fast.data(), line, layer);
      chain_seeds_ref(u.data(), mask, seeds, exact.data(), line, layer);
      CHECK(fast == exact);  // between the lines as well: nothing is written there
      for (std::size_t n = 0; n < 512; ++n) {
        if (n / 64 >= std::size_t(seeds.layers) || n / 8 % 8 >= std::size_t(seeds.lines)) continue;
        const bool in = mask[n / 64] >> (n % 64) & 1;
        const Chain c = fast[n / 64 * layer + n / 8 % 8 * line + n % 8];
        if (in || seeds.through)
          CHECK(c * kChainUnit >= 0.9f + (in ? -u[n] : u[n]));
        else
          CHECK(c == kChainFar);
      }
    }
  });
}

TEST_CASE("chain_nearest: every target says what the reference says, the first of equals") {
  on_every_target([](const std::string&) {
    std::mt19937_64 random(6);
    std::size_t found = 0;
    for (int i = 0; i < 60; ++i) {
      Room room(10 + std::size_t(i) % 7, 200);
      const unsigned far = i % 4 == 3 ? 60 : 3;
      for (Chain& c : room.v) c = random() % far ? kChainFar : Chain(int(random() % 4) * 107);
      std::uint64_t mask[8];
      for (std::uint64_t& m : mask) m = random() & random() & random() & random();
      std::vector<std::uint8_t> fast(512, 99), exact(512, 99);
      chain_nearest(room.first(), room.line, room.layer, mask, fast.data());
      chain_nearest_ref(room.first(), room.line, room.layer, mask, exact.data());
      CHECK(fast == exact);
      for (std::size_t n = 0; n < 512; ++n) found += exact[n] < 27 && exact[n] != 13;
    }
    CHECK(found > 1000);
  });
}

TEST_CASE("chain_sides: every target says what the reference says, on the limits too") {
  on_every_target([](const std::string&) {
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
    Room room(16, 160);
    room.v[room.at(seed)] = 0;
    for (int step = 0; step < 8; ++step) chain_step(room.first(), 16, 160, room.first(), 16, 160);
    for (int n = 0; n < 512; ++n) {
      const double d[3] = {double(n % 8 - seed % 8), double(n / 8 % 8 - seed / 8 % 8),
                           double(n / 64 - seed / 64)};
      const double straight = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const double chain = double(room.v[room.at(n)]) * kChainUnit;
      CHECK(chain >= straight - 1e-9);
      CHECK(chain <= 1.135 * straight);
    }
  }
}
