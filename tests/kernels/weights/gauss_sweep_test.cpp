// SPDX-License-Identifier: Apache-2.0
// gauss_sweep_test.cpp - the sweep gives the weights of the specification, at any number of
// contacts.
#include "kernels/weights/gauss_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <string>
#include <thread>
#include <vector>
#include "tests/kernels/weights/gauss_cases.h"
#include "tests/kernels/weights/gauss_sets.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Sweep {
  static constexpr int kStages = kGaussSweepStages;
  static constexpr std::size_t kMany = 9000, kMost = 7000;
  static constexpr auto bytes = gauss_sweep_bytes;
  static constexpr auto all = gauss_weights_sweep;
  static constexpr auto make = gauss_sweep;
  static constexpr auto slices = gauss_sweep_slices;
  static constexpr auto run = gauss_sweep_run;
};

}  // namespace

TEST_CASE("gauss_sweep: weights are those of the reference on every target, count and alignment") {
  check_counts<Sweep>();
}

TEST_CASE("gauss_sweep: weights are right however thousands of contacts lie") {
  check_thousands<Sweep>();
}

TEST_CASE("gauss_sweep: any order of slices, and any threads, give the same bits") {
  check_same_bits_on_any_thread<Sweep>();
}

TEST_CASE("gauss_sweep: coincident contacts share one contact's stiffness, whatever their number") {
  check_coincident<Sweep>();
}

TEST_CASE("gauss_sweep: weights stay within 0 and 1 at any depth and width") {
  check_bounds<Sweep>();
}

TEST_CASE("gauss_sweep: contacts that face away weigh nothing, were they all to") {
  check_facing_away<Sweep>();
}

TEST_CASE("gauss_sweep: columns that are not numbers do no harm outside the weights") {
  check_not_numbers<Sweep>();
}

TEST_CASE("gauss_sweep: contacts of one direction weigh the same one after the other or apart") {
  on_every_target([](const std::string&) {
    for (const Hat hat : {Hat::normal, Hat::sum}) {
      // Nine in ten stand on three walls: in runs, or by turns.
      const std::size_t n = 3000;
      Contacts runs = contacts_of(Set::spread, n, kPaper);
      Contacts turns = contacts_of(Set::spread, n, kPaper);
      for (std::size_t i = 0; i < n; ++i) {
        if (i % 10 == 9) continue;
        for (int k = 0; k < 3; ++k) {
          runs.column[k][i] = k == static_cast<int>(3 * i / n);
          turns.column[k][i] = k == static_cast<int>(i % 3);
        }
      }
      for (const bool weighted : {false, true}) {
        CHECK(worst_error<Sweep>(runs, hat, kPaper, weighted, 7) <= kTolerance);
        CHECK(worst_error<Sweep>(turns, hat, kPaper, weighted, 7) <= kTolerance);
      }
    }
  });
}

TEST_CASE("gauss_sweep: blocks that are passed over change no bit") {
  // A plate of 1,000 contacts: equal normals, torque directions all over the plane.
  constexpr std::size_t kSide = 32, kCount = kSide * kSide - 24;
  std::vector<float> column[6];
  for (std::size_t i = 0; i < kCount; ++i) {
    const float x = float(i % kSide) / kSide - 0.5f, y = float(i / kSide) / kSide - 0.5f;
    const float direction[6] = {0.6f, 0, 0.8f, y, -x, 0};
    for (int k = 0; k < 6; ++k) column[k].push_back(direction[k]);
  }
  DirectionsView view{};
  view.nx = column[0].data(), view.ny = column[1].data(), view.nz = column[2].data();
  view.tx = column[3].data(), view.ty = column[4].data(), view.tz = column[5].data();
  view.count = kCount;
  on_every_target([&](const std::string&) {
    std::vector<std::byte> memory(gauss_sweep_bytes(kCount, Hat::product));
    std::vector<float> with(kCount), without(kCount);
    const auto weigh = [&](bool boxed, float* weight) {
      const GaussSweep sweep =
          gauss_sweep(view, Hat::product, {0.3f, 0.07f}, memory.data(), weight);
      gauss_sweep_run(sweep, 0, 0);
      REQUIRE(sweep.product->boxed);
      sweep.product->boxed = boxed;
      for (int stage = 1; stage < kGaussSweepStages; ++stage)
        for (std::size_t i = 0; i < gauss_sweep_slices(sweep, stage); ++i)
          gauss_sweep_run(sweep, stage, i);
    };
    weigh(true, with.data());
    weigh(false, without.data());
    CHECK(with == without);
  });
}
