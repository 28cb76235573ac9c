// SPDX-License-Identifier: Apache-2.0
// friction_rows_test.cpp - lines along which pushes rub, stretches, sums and stiffness of friction.
#include "kernels/contact/friction_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

const double kNow[6] = {2e-4, -1e-4, 3e-4, 4e-3, -2e-3, 1e-3};
const double kThen[6] = {1e-4, 2e-4, -3e-4, -5e-3, 2e-3, 3e-3};

// Rows of which a third has no load; now and then sixteen in a row have none.
struct Rows {
  std::vector<Column> column;  // n, r, load, gradient
  std::size_t count;
  Rows(std::size_t n, std::size_t shift) : count(n) {
    Random random(60 + n);
    for (std::size_t k = 0; k < 10; ++k) column.emplace_back(n, shift + k % 3);
    for (std::size_t i = 0; i < n; ++i) {
      double v[3], lean[3];
      random.direction(v);
      random.direction(lean);
      // Every fourth gradient is some way off the push, the others only a little.
      const double off = i % 4 == 0 ? random.uniform(0, 1.5) : random.uniform(0, 0.05);
      double length = 0;
      for (std::size_t k = 0; k < 3; ++k) lean[k] = v[k] + off * lean[k];
      for (std::size_t k = 0; k < 3; ++k) length += lean[k] * lean[k];
      for (std::size_t k = 0; k < 3; ++k) {
        column[k][i] = float(v[k]);
        column[3 + k][i] = float(random.uniform(-0.1, 0.1));
        column[7 + k][i] = float(lean[k] / std::sqrt(length));
      }
      const bool idle = i % 3 == 1 || (i / 16) % 3 == 1;
      column[6][i] = idle ? 0.0f : float(random.uniform(1e-6, 1e-4));
    }
  }
  FrictionRows view(bool lines) {
    const auto p = [&](std::size_t k) { return column[k].begin(); };
    return {p(0), p(1), p(2), p(3), p(4), p(5), p(6), count, lines};
  }
  ContactColumns pushes() {
    const auto p = [&](std::size_t k) { return column[k].begin(); };
    return {p(0), p(1), p(2), p(7), p(8), p(9), p(3), p(4), p(5), count};
  }
};

// Followed by NaN, which must neither be read nor written over.
std::vector<double> with_nan(std::size_t n) {
  std::vector<double> out(n + 16, std::numeric_limits<double>::quiet_NaN());
  std::fill_n(out.begin(), n, 0.0);
  return out;
}

}  // namespace

TEST_CASE("friction_rows: lines and their loads agree with the reference on every target") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Rows rows(n, n % 4);
      std::vector<Column> got, want;  // e, r, load
      for (std::size_t k = 0; k < 7; ++k) got.emplace_back(n, k), want.emplace_back(n, 0);
      const auto run = [&](const auto& kernel, std::vector<Column>& to) {
        const auto p = [&](std::size_t k) { return to[k].begin(); };
        return kernel(rows.pushes(), rows.column[6].begin(),
                      PushLines{p(0), p(1), p(2), p(3), p(4), p(5), p(6)});
      };
      const PushLineRows found = run(push_lines, got), right = run(push_lines_ref, want);
      CHECK(std::fabs(found.total - right.total) <= 1e-5 * right.total);
      for (Column& column : got) CHECK(column.padding_untouched());
      REQUIRE(found.count <= n);
      std::size_t next = 0;
      for (std::size_t i = 0; i < found.count; ++i) {
        double length = 0;
        for (std::size_t k = 0; k < 3; ++k) length += double{got[k][i]} * double{got[k][i]};
        if (got[6][i] == 0) CHECK(length == 0);
        if (!(got[6][i] > 0)) continue;
        CHECK(std::fabs(length - 1) < 2e-5);
        // A load comes in two hundred times as fast as the tangent of the lean, and the line of a
        // push that leans little turns with the rounding of its gradient. One that hardly leans may
        // be missing in one of the two.
        while (next < right.count && want[3][next] != got[3][i]) CHECK(want[6][next++] < 1e-9f);
        if (next == right.count) CHECK(got[6][i] < 1e-9f);
        if (next == right.count) break;
        CHECK(std::fabs(double{got[6][i]} - double{want[6][next]}) <= 2e-5 * 1e-4);
        for (std::size_t k = 0; k < 3; ++k) {
          CHECK(std::fabs(double{got[k][i]} - double{want[k][next]}) < 2e-5);
          CHECK(got[3 + k][i] == want[3 + k][next]);
        }
        ++next;
      }
      CHECK(next + 1 >= right.count);
    }
  });
}

TEST_CASE("friction_rows: a push rubs by the tangent of its lean, neither little nor without end") {
  const auto lean_at = [](double angle) {
    const float n[3] = {float(std::sin(angle)), 0, float(std::cos(angle))}, g[3] = {0, 0, 1};
    const ContactColumns one{n, n + 1, n + 2, g, g + 1, g + 2, n, n, n, 1};
    const float pressed = 1;
    float to[7];
    const PushLineRows rows =
        push_lines_ref(one, &pressed, {to, to + 1, to + 2, to + 3, to + 4, to + 5, to + 6});
    if (rows.count == 0) return 0.0;
    // The rounding of floats over a lean of 0.005 turns e by up to 2e-5.
    CHECK(to[2] < 0);                                       // along e depth grows
    CHECK(std::fabs(to[0] * n[0] + to[2] * n[2]) < 2e-5f);  // and the push does no work
    CHECK(rows.total == double{to[6]});
    return rows.total;
  };
  for (const double angle : {0.0, 0.002, 0.0049}) CHECK(lean_at(angle) == 0);
  for (double angle = 0; angle < 0.06; angle += 2.5e-4)  // it comes in without a jump
    CHECK(std::fabs(lean_at(angle + 2.5e-4) - lean_at(angle)) < 1e-3);
  for (const double angle : {0.05, 0.2, 0.4})
    CHECK(lean_at(angle) == doctest::Approx(std::tan(angle)).epsilon(1e-5));
  for (const double angle : {0.8, 1.5, 3.0}) CHECK(lean_at(angle) == doctest::Approx(1.0));
}

TEST_CASE("friction_rows: stretches and their sums agree with the reference on every target") {
  on_every_target([](const std::string&) {
    for (const bool lines : {false, true})
      for (std::size_t n = 0; n <= 67; ++n) {
        Rows rows(n, n % 4);
        std::vector<double> got = with_nan(n), want = with_nan(n);
        friction_stretch(rows.view(lines), kNow, got.data());
        friction_stretch_ref(rows.view(lines), kNow, want.data());
        for (std::size_t i = 0; i < n; ++i) {
          if (rows.column[6][i] > 0) CHECK(std::fabs(got[i] - want[i]) < 1e-18 + 1e-12 * want[i]);
          CHECK(got[i] >= 0);
        }
        for (std::size_t i = n; i < got.size(); ++i) CHECK(std::isnan(got[i]));
        for (const double share : {1.0, 0.3})
          for (const double limit : {1e-5, 2e-4, 1.0}) {
            const float* const load = rows.column[6].begin();
            const FrictionSums a = friction_sums(load, got.data(), n, share, limit);
            const FrictionSums b = friction_sums_ref(load, got.data(), n, share, limit);
            CHECK(std::fabs(a.stretched - b.stretched) <= 1e-12 * b.stretched);
            CHECK(std::fabs(a.linear - b.linear) <= 1e-12 * b.linear);
            CHECK(std::fabs(a.capped - b.capped) <= 1e-12 * b.capped);
            CHECK(std::fabs(a.sticking - b.sticking) <= 1e-12 * b.sticking);
            CHECK(std::fabs(a.energy - b.energy) <= 1e-12 * b.energy);
            CHECK(a.slips == b.slips);
          }
      }
  });
}

TEST_CASE("friction_rows: the stiffness agrees with the reference on every target and count") {
  on_every_target([](const std::string&) {
    for (const bool lines : {false, true})
      for (const double limit : {1e-6, 2e-4, 1.0})
        for (std::size_t n = 0; n <= 67; ++n) {
          Rows rows(n, n % 4);
          double got[36], want[36], most = 0;
          for (int k = 0; k < 36; ++k) got[k] = want[k] = k % 7 == 0 ? 5.0 : 0.0;
          friction_stiffness(rows.view(lines), {3.0, limit}, kNow, kThen, got);
          friction_stiffness_ref(rows.view(lines), {3.0, limit}, kNow, kThen, want);
          for (const double w : want) most = std::max(most, std::fabs(w));
          for (int k = 0; k < 36; ++k) {
            CHECK(std::fabs(got[k] - want[k]) <= 1e-13 * most);
            CHECK(got[k] == got[6 * (k % 6) + k / 6]);
          }
        }
  });
}

TEST_CASE(
    "friction_rows: a row gives k and no more than its load, in its plane or along its line") {
  for (const bool lines : {false, true})
    for (const double limit : {1e-6, 1.0}) {
      Rows rows(1, 0);
      double K[36] = {}, f[6] = {}, z;
      const double load = double{rows.column[6][0]};
      friction_stiffness(rows.view(lines), {limit, limit}, kNow, kNow, K);
      friction_stretch(rows.view(lines), kNow, &z);
      for (int k = 0; k < 36; ++k) f[k / 6] += K[k] * kNow[k % 6];
      const double force = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
      // It sticks where the limit is far off, and slips with its whole load beyond it.
      CHECK(force == doctest::Approx(load * std::min(z, limit)).epsilon(1e-9));
      if (!lines) CHECK(z > 0);
    }
}
