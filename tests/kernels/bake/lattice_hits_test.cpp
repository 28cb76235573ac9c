// SPDX-License-Identifier: Apache-2.0
// Lines of a lattice through a triangle: SIMD against the reference, and against geometry.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "kernels/bake/lattice_hits.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;
using h6::kernels::test::Random;

namespace {

using Corners = std::array<std::array<std::int32_t, 3>, 3>;
constexpr std::int32_t kVoxel = std::int32_t(kLatticeVoxel);
constexpr std::int32_t kFirst[3] = {0, 0, 0}, kLast[3] = {31, 31, 31};

// Corners up to `size` voxels from a middle in the tile; `coarse`: on multiples of that.
Corners random_triangle(Random& random, double size, std::int32_t coarse) {
  Corners t;
  double middle[3];
  for (double& m : middle) m = random.uniform(0, 31);
  for (auto& corner : t)
    for (int k = 0; k < 3; ++k) {
      const double at = (middle[k] + random.uniform(-size, size)) * kLatticeVoxel;
      corner[std::size_t(k)] =
          std::clamp(std::int32_t(at) / coarse * coarse, 1 - kLatticeMost, kLatticeMost - 1);
    }
  return t;
}

void check_same(const LatticeHits& a, const LatticeHits& b) {
  for (int axis = 0; axis < 3; ++axis) {
    REQUIRE(a.count[axis] == b.count[axis]);
    CHECK(std::equal(a.slot[axis], a.slot[axis] + a.count[axis], b.slot[axis]));
    for (std::size_t n = 0; n < a.count[axis]; ++n)
      CHECK(a.at[axis][a.slot[axis][n]] == b.at[axis][a.slot[axis][n]]);
  }
}

const std::int32_t (*raw(const Corners& t))[3] {
  return reinterpret_cast<const std::int32_t(*)[3]>(t.data());
}

}  // namespace

TEST_CASE("lattice_hits: SIMD agrees with the reference to the bit, for every size and part") {
  on_every_target([](const std::string&) {
    Random random(5);
    const auto fast = std::make_unique<LatticeHits>(), slow = std::make_unique<LatticeHits>();
    std::size_t met = 0;
    for (int i = 0; i < 3000; ++i) {
      const double size = std::pow(2.0, random.uniform(-4, 6));
      const std::int32_t coarse = i % 3 == 0 ? kVoxel : i % 3 == 1 ? kVoxel / 2 : 1;
      const Corners t = random_triangle(random, size, coarse);
      std::int32_t first[3], last[3];
      for (std::size_t k = 0; k < 3; ++k) {
        first[k] = std::int32_t(random.below(32));
        last[k] = first[k] - 1 + std::int32_t(random.below(std::size_t(33 - first[k])));
      }
      lattice_hits(raw(t), i % 2 ? first : kFirst, i % 2 ? last : kLast, *fast);
      lattice_hits_ref(raw(t), i % 2 ? first : kFirst, i % 2 ? last : kLast, *slow);
      check_same(*fast, *slow);
      met += slow->count[0] + slow->count[1] + slow->count[2];
    }
    CHECK(met > 10000);
  });
}

TEST_CASE("lattice_hits: a line through an edge or a corner meets every face that has it") {
  // A square of nodes in two triangles: lines on the border and on the diagonal are met too.
  const auto hits = std::make_unique<LatticeHits>();
  constexpr std::int32_t v = kVoxel;
  const Corners lower{{{2 * v, 3 * v, 5 * v}, {6 * v, 3 * v, 5 * v}, {6 * v, 7 * v, 5 * v}}};
  const Corners upper{{{2 * v, 3 * v, 5 * v}, {2 * v, 7 * v, 5 * v}, {6 * v, 7 * v, 5 * v}}};
  for (const Corners& t : {lower, upper}) {
    lattice_hits(raw(t), kFirst, kLast, *hits);
    CHECK(hits->count[0] == 0);  // parallel to it
    CHECK(hits->count[1] == 0);
    CHECK(hits->count[2] == 15);
    for (std::size_t n = 0; n < hits->count[2]; ++n) CHECK(hits->at[2][hits->slot[2][n]] == 5.0);
  }
}

TEST_CASE("lattice_hits: where a line meets a plane is where the plane's equation says") {
  Random random(9);
  const auto hits = std::make_unique<LatticeHits>();
  for (int i = 0; i < 200; ++i) {
    const Corners t = random_triangle(random, 12, 1);
    double p[3][3], n[3];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) p[c][k] = double(t[c][k]) / kLatticeVoxel;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      n[k] = (p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) - (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]);
    }
    lattice_hits(raw(t), kFirst, kLast, *hits);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t h = 0; h < hits->count[axis]; ++h) {
        double at[3];
        const std::uint32_t slot = hits->slot[axis][h];
        at[axis] = hits->at[axis][slot];
        at[(axis + 1) % 3] = double(slot % 32);
        at[(axis + 2) % 3] = double(slot / 32);
        double off = 0, size = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          off += n[k] * (at[k] - p[0][k]);
          size += std::fabs(n[k]);
        }
        CHECK(std::fabs(off) < 1e-9 * size);
      }
  }
}
