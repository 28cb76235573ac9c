// SPDX-License-Identifier: Apache-2.0
// targets_test.cpp - a forced target is the one that runs.
#include <map>
#include <set>
#include <string>
#include <vector>

#include "kernels/weights/gauss_few.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

TEST_CASE("the best target runs unless another is forced, and again afterwards") {
  const auto targets = all_targets();
  REQUIRE(!targets.empty());
  CHECK(target_name() == targets.front());
  REQUIRE(force_target(targets.back().c_str()));
  CHECK(target_name() == targets.back());
  CHECK(all_targets() == targets);  // forcing one does not hide the others
  REQUIRE(force_target(nullptr));
  CHECK(target_name() == targets.front());
}

TEST_CASE("a target that does not exist is refused and changes nothing") {
  const std::string before = target_name();
  CHECK(!force_target("MMX"));
  CHECK(!force_target(""));
  CHECK(target_name() == before);
}

TEST_CASE("kernels really run on the forced target: vector lengths show in the rounding") {
  Random random(3);
  std::vector<float> nx(kGaussFew), ny(kGaussFew), nz(kGaussFew);
  for (std::size_t i = 0; i < nx.size(); ++i) {
    double v[3];
    random.direction(v);
    nx[i] = float(v[0]), ny[i] = float(v[1]), nz[i] = float(v[2]);
  }
  const DirectionsView c{nx.data(), ny.data(), nz.data(), nullptr,  nullptr,
                         nullptr,   nullptr,   nullptr,   nx.size()};
  // Sums are taken in an order that depends on the vector length: 1, 4, 8 or 16 floats.
  const std::map<std::string, int> lanes = {{"SCALAR", 1}, {"SSSE3", 4}, {"SSE4", 4},
                                            {"NEON", 4},   {"AVX2", 8},  {"AVX3", 16}};
  std::set<std::vector<float>> results;
  std::set<int> lengths;
  on_every_target([&](const std::string& target) {
    std::vector<float> weight(nx.size());
    gauss_weights_few(c, Hat::normal, {1.0f, 1.0f}, weight.data());
    results.insert(weight);
    if (lanes.count(target) != 0) lengths.insert(lanes.at(target));
  });
  CHECK(results.size() >= lengths.size());
}
