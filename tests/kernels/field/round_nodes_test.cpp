// SPDX-License-Identifier: Apache-2.0
// round_nodes_test.cpp - nodes of a field as whole numbers, against their specification.
#include "kernels/field/round_nodes.h"

#include <cmath>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

void agree(const float* metres, double voxel, double quantum, std::size_t count) {
  std::vector<std::int16_t> got(count + 2, 77), want(count + 2, 77);
  round_nodes(metres, voxel, quantum, count, got.data() + 1);
  round_nodes_ref(metres, voxel, quantum, count, want.data() + 1);
  CHECK(got == want);
}

}  // namespace

TEST_CASE("round_nodes: nodes are those of the specification, for any count and alignment") {
  on_every_target([](const std::string&) {
    Random random(3);
    for (std::size_t n = 0; n < 68; ++n)
      for (const std::size_t shift : {0, 1, 3}) {
        Column metres(n, shift);
        const double voxel = random.uniform(1e-5, 1e-2);
        for (std::size_t i = 0; i < n; ++i)
          metres[i] = float(random.uniform(-40, 40) * voxel);  // some are out of range
        agree(metres.begin(), voxel, 1.0 / 1024, n);
        agree(metres.begin(), voxel, 1.0 / 4096, n);
      }
  });
}

TEST_CASE("round_nodes: ties, and what is next to them, round as the quotient does") {
  on_every_target([](const std::string&) {
    Random random(4);
    int ties = 0;
    for (int i = 0; i < 3000; ++i) {
      const double half = std::floor(random.uniform(0, 32770)) + 0.5;
      const auto tie = float(random.uniform(1e-4, 1e-2));
      const double voxel = tie * 1024.0 / half;
      const float near[] = {
          tie, std::nextafter(tie, 1.0f), std::nextafter(tie, -1.0f), -tie, 0.0f, -0.0f, tie, tie};
      agree(near, voxel, 1.0 / 1024, 8);
      ties += tie / voxel * 1024 == half;
    }
    CHECK(ties > 500);
  });
}

TEST_CASE("round_nodes: a voxel so small that its inverse is infinite changes nothing") {
  const float metres[] = {0.0f, 1e-45f, -1.0f, 0.0f, 1.0f, 0.0f, 0.0f, -0.0f};
  on_every_target([&](const std::string&) { agree(metres, 1e-308, 1.0 / 1024, 8); });
}

TEST_CASE("round_nodes: the nearest whole number, even at a tie, and at most 32767") {
  const float metres[] = {0.5f, 1.5f, 2.5f, -0.5f, -1.5f, 0.51f, 40000.0f, -40000.0f, 32767.4f};
  const std::int16_t want[] = {0, 2, 2, 0, -2, 1, 32767, -32767, 32767};
  std::int16_t got[9];
  round_nodes(metres, 1.0, 1.0, 9, got);
  for (int i = 0; i < 9; ++i) CHECK(got[i] == want[i]);
}
