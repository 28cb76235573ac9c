// SPDX-License-Identifier: Apache-2.0
// touch_groups_test.cpp - the kernels of traversal agree with their specifications on every target.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/contact/touch_groups.h"
#include "tests/kernels/field/analytic_field.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Hits {
  std::vector<std::uint32_t> row;
  std::vector<float> d, gx, gy, gz;
  explicit Hits(std::size_t n) : row(n), d(n), gx(n), gy(n), gz(n) {}
  Touching columns() { return {row.data(), d.data(), gx.data(), gy.data(), gz.data()}; }
};

struct Learnt {
  std::vector<float> least, rest;
  std::vector<std::uint16_t> near_rows;
  explicit Learnt(std::size_t n) : least(n), rest(n), near_rows(n) {}
  GroupLook columns(const std::uint16_t* rows, const float* reach) {
    return {rows, least.data(), near_rows.data(), rest.data(), 0.3f, reach};
  }
};

bool near(float a, float b) { return a == b || std::fabs(a - b) < 1e-3f; }

// Points in `field`, by the kernel and by its reference.
void touch_alike(const AnalyticField& field) {
  on_every_target([&](const std::string&) {
    for (std::size_t count : {1, 15, 16, 17, 40, 333, 999}) {
      Random random(count);
      const std::size_t groups = (count + 15) / 16;
      std::vector<float> x(16 * groups), y(x), z(x);
      for (std::size_t i = 0; i < x.size(); ++i) {
        x[i] = float(random.uniform(-10, 138));
        y[i] = float(random.uniform(-10, 146));
        z[i] = float(random.uniform(-10, 154));
      }
      if (count > 20) y[17] = std::numeric_limits<float>::quiet_NaN();
      const PointsView points{x.data(), y.data(), z.data(), count};
      std::vector<std::uint32_t> list;
      for (std::uint32_t g = 0; g < groups; ++g)
        if (g % 3 != 1) list.push_back(g);
      for (const float limit : {0.0f, 0.5f, 4.0f, -4.0f}) {
        const bool each = limit < 0;  // every group has a reach of its own
        std::vector<float> reach(groups);
        for (float& r : reach) r = float(std::max(0.0, random.uniform(-2, 4)));
        Hits got(16 * list.size()), want(16 * list.size());
        // All points of some groups, some of others, none of a few.
        std::vector<std::uint16_t> rows(list.size());
        for (std::size_t k = 0; k < rows.size(); ++k)
          rows[k] = k % 2 ? kAllRows : std::uint16_t(k % 8 ? random.below(65536) : 0);
        const bool some = limit > 0 || (each && count % 3 > 0);
        Learnt learnt(list.size()), learnt_want(list.size());
        const GroupLook look =
            learnt.columns(some ? rows.data() : nullptr, each ? reach.data() : nullptr);
        const GroupLook look_want = learnt_want.columns(look.rows, look.reach);
        const std::size_t n =
            touch_groups_ref(field.view(), kIdentity, points, list.data(), list.size(),
                             std::fabs(limit), false, look_want, want.columns());
        const bool cold = count % 2 == 1;  // changes only the prefetches
        REQUIRE(touch_groups(field.view(), kIdentity, points, list.data(), list.size(),
                             std::fabs(limit), cold, look, got.columns()) == n);
        for (std::size_t i = 0; i < n; ++i) {
          CHECK(got.row[i] == want.row[i]);
          CHECK(got.row[i] < count);
          CHECK(std::fabs(got.d[i] - want.d[i]) < 1e-3f);
          CHECK(std::fabs(got.gx[i] - want.gx[i]) + std::fabs(got.gy[i] - want.gy[i]) +
                    std::fabs(got.gz[i] - want.gz[i]) <
                1e-3f);
        }
        for (std::size_t k = 0; k < list.size(); ++k) {
          CHECK(near(learnt.least[k], learnt_want.least[k]));
          if (!some || rows[k] != kAllRows) continue;
          CHECK(learnt.near_rows[k] == learnt_want.near_rows[k]);
          CHECK(near(learnt.rest[k], learnt_want.rest[k]));
        }
      }
    }
  });
}

}  // namespace

TEST_CASE("touch_groups: SIMD finds the same points as the reference, and writes nothing beyond") {
  touch_alike(AnalyticField(16, 17, 18, clutter));
}

TEST_CASE("touch_groups: SIMD finds the same points where cells have finer samples") {
  touch_alike(AnalyticField(16, 17, 18, clutter, 3.0, 0.001, 1.0, scattered_cut));
}

namespace {

// Compares rough bounds of groups with exact ones; more than `least_rough` differ.
void bound_roughly(const AnalyticField& field, std::size_t least_rough) {
  constexpr std::size_t kGroups = 600;
  Random random(4);
  std::vector<float> column[3];
  std::vector<std::uint32_t> list;
  for (std::uint32_t g = 0; g < kGroups; ++g) {
    const double centre[3] = {random.uniform(0, 127), random.uniform(0, 135),
                              random.uniform(0, 143)};
    list.push_back(g);
    for (int i = 0; i < 16; ++i)
      for (int k = 0; k < 3; ++k) column[k].push_back(float(centre[k] + random.uniform(-3, 3)));
  }
  const PointsView points{column[0].data(), column[1].data(), column[2].data(), 16 * kGroups};
  on_every_target([&](const std::string& target) {
    for (const float limit : {0.0f, 0.5f, 8.0f}) {  // 8: beyond the band
      Hits got(16 * kGroups), want(16 * kGroups);
      std::vector<float> least(kGroups), exact(kGroups);
      const std::size_t n =
          touch_groups_ref(field.view(), kIdentity, points, list.data(), kGroups, limit, false,
                           {nullptr, exact.data(), nullptr, nullptr, 0}, want.columns());
      REQUIRE(touch_groups(field.view(), kIdentity, points, list.data(), kGroups, limit, true,
                           {nullptr, least.data(), nullptr, nullptr, 0, nullptr, true},
                           got.columns()) == n);
      CHECK(n > kGroups / 2);
      for (std::size_t i = 0; i < n; ++i) {
        CHECK(got.row[i] == want.row[i]);
        CHECK(std::fabs(got.d[i] - want.d[i]) < 1e-3f);
      }
      std::size_t rough = 0;
      for (std::size_t k = 0; k < kGroups; ++k) {
        if (near(least[k], exact[k])) continue;
        ++rough;
        CHECK(least[k] < exact[k]);
        CHECK(least[k] >= field.view().band);
      }
      if (target != "SCALAR") CHECK(rough > least_rough);  // a vector of one point is never mixed
      CHECK(rough < kGroups / 2);
    }
  });
}

}  // namespace

TEST_CASE("touch_groups: a rough least distance is a bound, and the same points touch") {
  bound_roughly(AnalyticField(16, 17, 18, clutter), 10);
}

TEST_CASE("touch_groups: the same where cells have finer samples") {
  bound_roughly(AnalyticField(16, 17, 18, clutter, 3.0, 0.001, 1.0, scattered_cut), 0);
}

TEST_CASE("make_contacts: SIMD agrees with the reference on every target and count") {
  on_every_target([](const std::string&) {
    Random random(8);
    const std::size_t shell = 100, padded = 112;
    std::vector<float> c[6];
    std::vector<std::uint32_t> point(padded);
    for (auto& column : c)
      for (std::size_t i = 0; i < padded; ++i) column.push_back(float(random.uniform(-1, 1)));
    for (std::size_t i = 0; i < shell; ++i) point[i] = std::uint32_t(1000 - i);
    const ShellColumns columns{c[0].data(), c[1].data(), c[2].data(), c[3].data(),
                               c[4].data(), c[5].data(), point.data()};
    ContactFrame frame{{0.6f, -0.8f, 0, 0.8f, 0.6f, 0, 0, 0, 1},
                       {1, 0, 0, 0, 0.8f, 0.6f, 0, -0.6f, 0.8f},
                       {0.1f, -0.2f, 0.3f},
                       0.5f};
    for (std::size_t n = 0; n <= 67; ++n) {
      Hits hits(n + 1);
      for (std::size_t i = 0; i < n; ++i) {
        // Anywhere, or in runs as groups leave them.
        hits.row[i] = std::uint32_t(n % 2 ? random.below(shell) : (i * (1 + n % 3)) % shell);
        hits.d[i] = float(random.uniform(-2, 0));
        if (i % 7 == 3) continue;  // no gradient: the normal
        hits.gx[i] = float(random.uniform(-1, 1)), hits.gy[i] = float(random.uniform(-1, 1));
        hits.gz[i] = float(random.uniform(-1, 1));
      }
      std::vector<float> got(10 * (n + 3), -7), want(got);
      std::vector<std::uint32_t> got_point(n + 3, 7), want_point(got_point);
      const auto of = [&](std::vector<float>& v, std::vector<std::uint32_t>& p) {
        float* at[10];
        for (std::size_t k = 0; k < 10; ++k) at[k] = v.data() + k * (n + 3);
        return MadeContacts{at[0], at[1], at[2], at[3], at[4],   at[5],
                            at[6], at[7], at[8], at[9], p.data()};
      };
      make_contacts(columns, hits.columns(), n, frame, of(got, got_point));
      make_contacts_ref(columns, hits.columns(), n, frame, of(want, want_point));
      CHECK(got_point == want_point);
      float worst = 0;
      for (std::size_t i = 0; i < got.size(); ++i)
        worst = std::max(worst, std::fabs(got[i] - want[i]));
      CHECK(worst < 2e-6f);
    }
  });
}
