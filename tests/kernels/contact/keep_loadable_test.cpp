// SPDX-License-Identifier: Apache-2.0
// keep_loadable_test.cpp - which contacts and groups can carry load before they touch.
#include "kernels/contact/keep_loadable.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

const float kAhead[6] = {0.2f, -0.3f, 0.1f, 2, 1, -3};  // [voxel], [voxel/m]
constexpr std::size_t kRows = 200;

// Points and normals of a shell, and rows of it that touch or nearly do.
struct Found {
  std::vector<std::vector<float>> shell;  // p n
  std::vector<Column> column;             // distance g
  std::vector<std::uint32_t> row;
  Found(std::size_t n, std::size_t shift) : shell(6, std::vector<float>(kRows)), row(n + 16, 7) {
    Random random(70 + n);
    for (std::size_t i = 0; i < kRows; ++i) {
      double v[3];
      random.direction(v);
      for (std::size_t k = 0; k < 3; ++k) shell[k][i] = float(random.uniform(-0.05, 0.05));
      for (std::size_t k = 0; k < 3; ++k) shell[3 + k][i] = float(v[k]);
    }
    for (std::size_t k = 0; k < 4; ++k) column.emplace_back(n, shift + k % 3);
    for (std::size_t i = 0; i < n; ++i) {
      row[i] = std::uint32_t(random.below(kRows));
      for (std::size_t k = 0; k < 4; ++k) column[k][i] = float(random.uniform(-0.2, 0.4));
    }
  }
  Touching rows() {
    return {row.data(), column[0].begin(), column[1].begin(), column[2].begin(), column[3].begin()};
  }
  ShellColumns points() const {
    return {shell[0].data(), shell[1].data(), shell[2].data(), shell[3].data(),
            shell[4].data(), shell[5].data(), nullptr};
  }
};

}  // namespace

TEST_CASE("keep_loadable: SIMD keeps the reference's rows, in order, on every target and count") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      CAPTURE(n);
      Found got(n, n % 4), want(n, n % 4);
      const std::size_t kept = keep_loadable(got.points(), got.rows(), n, kAhead);
      REQUIRE(kept == keep_loadable_ref(want.points(), want.rows(), n, kAhead));
      for (std::size_t k = 0; k < 4; ++k) {
        CHECK(std::equal(got.column[k].begin(), got.column[k].begin() + kept,
                         want.column[k].begin()));
        CHECK(got.column[k].padding_untouched());
      }
      CHECK(std::equal(got.row.begin(), got.row.begin() + std::ptrdiff_t(kept), want.row.begin()));
      CHECK(got.row[n] == 7);
      if (n == 67) CHECK(kept > 15);
      if (n == 67) CHECK(kept < 60);
    }
  });
}

TEST_CASE("keep_loadable: without a way ahead the rows that touch are kept, and no others") {
  Found found(500, 1);
  const float nowhere[6] = {};
  std::size_t touching = 0;
  for (std::size_t i = 0; i < 500; ++i) touching += found.column[0][i] < 0;
  CHECK(keep_loadable(found.points(), found.rows(), 500, nowhere) == touching);
  for (std::size_t i = 0; i < touching; ++i) CHECK(found.column[0][i] < 0);
}

TEST_CASE("loadable_groups: a group is dropped only if each of its points can be dropped") {
  Random random(3);
  constexpr std::size_t kGroups = 400;
  std::vector<std::vector<float>> tier(4, std::vector<float>(kGroups)), bundle = tier;
  std::vector<float> expiry(kGroups), now(kGroups / 16);
  for (float& w : now) w = float(random.uniform(8, 12));
  std::vector<std::uint32_t> blocks, rows;
  std::vector<bool> needed(kGroups);
  constexpr float kMost = 0.25f;
  const float way[6] = {0.1f, -0.2f, 0.05f, 4, 2, -6};  // [voxel], [voxel/m]
  for (std::uint32_t g = 0; g < kGroups; ++g) {
    if (g / 16 % 7 == 3) continue;
    if (g % 16 == 0) blocks.push_back(g / 16);
    rows.push_back(g);
    double axis[3], away[3], n[3];
    random.direction(axis);
    for (int k = 0; k < 3; ++k) tier[k][g] = float(random.uniform(-0.05, 0.05));
    for (int k = 0; k < 3; ++k) bundle[k][g] = float(axis[k]);
    tier[3][g] = float(random.uniform(0, 0.004));
    bundle[3][g] = float(random.uniform(0, 0.3));
    expiry[g] = now[g / 16] + float(random.uniform(-0.3, 0.3));
    // Points anywhere in the sphere, with any normal of the bundle.
    for (int i = 0; i < 16; ++i) {
      float p[3], normal[3];
      random.direction(away), random.direction(n);
      double length = 0;
      for (int k = 0; k < 3; ++k) {
        p[k] = tier[k][g] + tier[3][g] * float(away[k]);
        normal[k] = bundle[k][g] + bundle[3][g] * float(n[k]);
        length += double{normal[k]} * normal[k];
      }
      if (length > 1) continue;  // no unit vector
      const float q[3] = {way[0] + way[4] * p[2] - way[5] * p[1],
                          way[1] + way[5] * p[0] - way[3] * p[2],
                          way[2] + way[3] * p[1] - way[4] * p[0]};
      const float back = normal[0] * q[0] + normal[1] * q[1] + normal[2] * q[2];
      if (expiry[g] <= now[g / 16] + std::min(kMost, -back) - 1e-5f) needed[g] = true;
    }
  }
  const SpheresView spheres{tier[0].data(), tier[1].data(), tier[2].data(), tier[3].data(),
                            kGroups};
  const BundlesView normals{bundle[0].data(), bundle[1].data(), bundle[2].data(), bundle[3].data()};
  std::vector<float> farthest(kGroups, -1);
  std::vector<std::uint32_t> want(rows.size());
  want.resize(loadable_groups_ref(spheres, normals, way, kMost, expiry.data(), now.data(),
                                  blocks.data(), blocks.size(), farthest.data(), want.data()));
  for (const std::uint32_t g : rows) {
    if (needed[g] || expiry[g] <= now[g / 16])
      CHECK(std::find(want.begin(), want.end(), g) != want.end());
    CHECK(farthest[g] >= 0);
    CHECK(farthest[g] <= kMost);
  }
  CHECK(want.size() > rows.size() / 2);
  CHECK(want.size() < rows.size() * 9 / 10);
  on_every_target([&](const std::string&) {
    for (std::size_t n = 0; n <= blocks.size(); ++n) {
      std::vector<std::uint32_t> got(16 * n), exact(16 * n);
      std::vector<float> reach(kGroups, -1), reach_ref = reach;
      exact.resize(loadable_groups_ref(spheres, normals, way, kMost, expiry.data(), now.data(),
                                       blocks.data(), n, reach_ref.data(), exact.data()));
      got.resize(loadable_groups(spheres, normals, way, kMost, expiry.data(), now.data(),
                                 blocks.data(), n, reach.data(), got.data()));
      CHECK(got == exact);
      CHECK(reach == reach_ref);
    }
  });
}
