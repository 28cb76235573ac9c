// SPDX-License-Identifier: Apache-2.0
// Winding numbers: the specification's bits on every target, whole numbers around closed solids,
// and the solid angle of what is missing from an open one.
#include "kernels/bake/winding_numbers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;
using h6::kernels::test::Random;
using h6::kernels::test::same_bits;

namespace {

// The first `sides` sides of a cube, two triangles each, seen from outside counterclockwise.
std::vector<WindingLeaf> cube(double half, int sides, const double (&middle)[3]) {
  std::vector<WindingLeaf> leaves;
  for (int side = 0; side < sides; ++side) {
    WindingLeaf leaf{};
    const int k = side / 2, u = (k + 1) % 3, v = (k + 2) % 3, turned = side % 2;
    for (int i = 0; i < 3; ++i) leaf.origin[i] = middle[i];
    for (int c = 0; c < 4; ++c) {
      double at[3] = {};
      at[k] = turned ? half : -half;
      at[u] = (c == 1 || c == 2) == (turned == 1) ? half : -half;
      at[v] = c >= 2 ? half : -half;
      leaf.x[c] = float(at[0]), leaf.y[c] = float(at[1]), leaf.z[c] = float(at[2]);
    }
    leaf.vertices = 4, leaf.triangles = 2;
    const std::uint8_t corner[6] = {0, 1, 2, 0, 2, 3};
    std::memcpy(leaf.corner, corner, sizeof corner);
    leaves.push_back(leaf);
  }
  return leaves;
}

std::vector<float> around(const std::vector<WindingLeaf>& leaves, const double (&base)[3],
                          const WindingPlaces& offsets) {
  std::vector<std::uint32_t> all(leaves.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = std::uint32_t(i);
  float number[kWindingPlaces];
  winding_numbers(nullptr, nullptr, 0, leaves.data(), all.data(), all.size(), base, offsets,
                  number);
  return {number, number + kWindingPlaces};
}

WindingPlaces random_offsets(Random& random, double range) {
  WindingPlaces p;
  for (std::size_t i = 0; i < kWindingPlaces; ++i) {
    p.x[i] = float(random.uniform(-range, range));
    p.y[i] = float(random.uniform(-range, range));
    p.z[i] = float(random.uniform(-range, range));
  }
  return p;
}

}  // namespace

TEST_CASE("winding_numbers: the bits of the specification on every target") {
  on_every_target([](const std::string&) {
    Random random(5);
    std::vector<WindingLeaf> leaves(40);
    for (WindingLeaf& leaf : leaves) {
      for (double& o : leaf.origin) o = std::floor(random.uniform(0, 300));
      leaf.vertices = std::uint32_t(3 + random.below(22));
      leaf.triangles = std::uint32_t(1 + random.below(8));
      for (std::uint32_t v = 0; v < 24; ++v) {
        leaf.x[v] = float(random.uniform(-4, 4));
        leaf.y[v] = float(random.uniform(-4, 4));
        leaf.z[v] = float(random.uniform(-4, 4));
      }
      for (std::uint8_t& c : leaf.corner) c = std::uint8_t(random.below(leaf.vertices));
    }
    std::vector<WindingCluster> clusters(30);
    for (WindingCluster& c : clusters) {
      for (float& m : c.middle) m = float(random.uniform(0, 300));
      for (float& n : c.dipole) n = float(random.uniform(-1, 1));
      c.reach = 1;
    }
    for (int round = 0; round < 60; ++round) {
      std::vector<std::uint32_t> far(random.below(30)), near(random.below(40));
      for (auto& i : far) i = std::uint32_t(random.below(clusters.size()));
      for (auto& i : near) i = std::uint32_t(random.below(leaves.size()));
      double base[3];
      for (double& b : base) b = std::floor(random.uniform(0, 300));
      WindingPlaces places = random_offsets(random, 5);
      if (!near.empty()) {  // places on a vertex, on a rim, on nothing
        const WindingLeaf& leaf = leaves[near[0]];
        for (int k = 0; k < 3; ++k) base[k] = leaf.origin[k];
        places.x[0] = leaf.x[0], places.y[0] = leaf.y[0], places.z[0] = leaf.z[0];
      }
      float fast[kWindingPlaces], slow[kWindingPlaces];
      winding_numbers(clusters.data(), far.data(), far.size(), leaves.data(), near.data(),
                      near.size(), base, places, fast);
      winding_numbers_ref(clusters.data(), far.data(), far.size(), leaves.data(), near.data(),
                          near.size(), base, places, slow);
      CHECK(same_bits(fast, slow, kWindingPlaces));
    }
  });
}

TEST_CASE("winding_numbers: one in a closed cube, none outside, wherever it stands") {
  on_every_target([](const std::string&) {
    Random random(6);
    for (int round = 0; round < 20; ++round) {
      double middle[3], base[3];
      for (int k = 0; k < 3; ++k) {
        middle[k] = std::floor(random.uniform(0, 2000)) + 0.25;
        base[k] = std::floor(middle[k]);
      }
      const auto leaves = cube(3, 6, middle);
      const WindingPlaces places = random_offsets(random, 6);
      const auto number = around(leaves, base, places);
      for (std::size_t i = 0; i < kWindingPlaces; ++i) {
        const double x = std::fabs(places.x[i] - 0.25), y = std::fabs(places.y[i] - 0.25),
                     z = std::fabs(places.z[i] - 0.25), most = std::max({x, y, z});
        if (std::fabs(most - 3) < 1e-3) continue;
        CHECK(number[i] == doctest::Approx(most < 3 ? 1.0 : 0.0).epsilon(1e-5));
      }
    }
  });
}

TEST_CASE("winding_numbers: an open cube lacks the solid angle of its open side") {
  on_every_target([](const std::string&) {
    const double middle[3] = {100, 200, 300};
    const auto leaves = cube(2, 5, middle);  // without +z
    WindingPlaces places{};
    for (std::size_t i = 0; i < kWindingPlaces; ++i) places.z[i] = float(-1.9 + 0.2 * double(i));
    const auto number = around(leaves, middle, places);
    for (std::size_t i = 0; i < kWindingPlaces; ++i) {
      // A square seen from the height h over its middle fills 4 asin(a^2 / (a^2 + h^2)).
      const double h = 2 - double(places.z[i]), a2 = 4;
      const double missing = 4 * std::asin(a2 / (a2 + h * h)) / (4 * std::numbers::pi);
      CHECK(number[i] == doctest::Approx(1 - missing).epsilon(1e-5));
    }
  });
}

TEST_CASE("winding_numbers: a dipole stands for a small triangle far away") {
  on_every_target([](const std::string&) {
    WindingLeaf leaf{};
    leaf.x[1] = 1, leaf.y[2] = 1;
    leaf.vertices = 3, leaf.triangles = 1;
    const std::uint8_t corner[3] = {0, 1, 2};
    std::memcpy(leaf.corner, corner, sizeof corner);
    const WindingCluster cluster{
        {1 / 3.0f, 1 / 3.0f, 0}, 0.75f, {0, 0, float(0.5 / (4 * std::numbers::pi))}};
    Random random(7);
    const std::uint32_t first = 0;
    for (int round = 0; round < 20; ++round) {
      double base[3];
      random.direction(base);
      for (double& b : base) b *= 30;
      const WindingPlaces places = random_offsets(random, 2);
      float exact[kWindingPlaces], dipole[kWindingPlaces];
      winding_numbers(&cluster, &first, 0, &leaf, &first, 1, base, places, exact);
      winding_numbers(&cluster, &first, 1, &leaf, &first, 0, base, places, dipole);
      for (std::size_t i = 0; i < kWindingPlaces; ++i)
        CHECK(std::fabs(exact[i] - dipole[i]) < 2e-7);
    }
  });
}
