// SPDX-License-Identifier: Apache-2.0
// contact_columns_test.cpp - facing, torque directions, gaps and loads of every contact.
#include "kernels/contact/contact_columns.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr int kOut = 6;  // facing, tx ty tz, e, load

struct Contacts {
  std::vector<Column> column;  // N g r depth slack
  std::size_t count;
  Contacts(std::size_t n, std::size_t shift) : count(n) {
    Random random(40 + n);
    for (std::size_t k = 0; k < 11; ++k) column.emplace_back(n, shift + k % 3);
    for (std::size_t i = 0; i < n; ++i) {
      double v[3];
      for (std::size_t k = 0; k < 9; ++k) {
        if (k % 3 == 0) random.direction(v);
        column[k][i] = float(v[k % 3] * (k < 6 ? 1 : random.uniform(0.001, 0.2)));
      }
      // Now and then an arm along the normal.
      if (i % 9 == 4)
        for (std::size_t k = 0; k < 3; ++k) column[6 + k][i] = column[k][i];
      column[9][i] = float(random.uniform(-2e-4, 1e-3));
      column[10][i] = float(std::max(0.0, random.uniform(-5e-4, 1e-3)));
    }
  }
  ContactColumns view() {
    const auto p = [&](std::size_t k) { return column[k].begin(); };
    return {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), p(8), count};
  }
};

double worst(Column& got, Column& want, std::size_t count, double tolerance) {
  double most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double error = std::fabs(double{got[i]} - want[i]);
    most = std::max(most, std::isfinite(got[i]) ? error / tolerance : HUGE_VAL);
  }
  CHECK(got.padding_untouched());
  return most;
}

}  // namespace

TEST_CASE("contact_columns: depths are counted and the largest found on every target and count") {
  on_every_target([](const std::string&) {
    Random random(12);
    for (std::size_t n = 0; n <= 67; ++n) {
      Column depth(n, n % 5);  // followed by NaN
      for (std::size_t i = 0; i < n; ++i)
        depth[i] = i % 4 == 1 ? 0.0f : float(random.uniform(-1e-3, n % 3 == 0 ? 0 : 1e-3));
      const Depths got = look_at_depths(depth.begin(), n);
      const Depths want = look_at_depths_ref(depth.begin(), n);
      CHECK(got.inside == want.inside);
      CHECK(got.deepest == want.deepest);
      CHECK((got.deepest > 0) == (got.inside > 0));
    }
  });
}

TEST_CASE("contact_columns: SIMD agrees with the reference on every target, count and alignment") {
  const double u[6] = {0.3, -0.2, 0.1, 2, -3, 1};
  on_every_target([&](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c(n, n % 4);
      const ContactColumns view = c.view();
      std::vector<Column> got, want;
      for (std::size_t k = 0; k < kOut + 1; ++k) got.emplace_back(n, k), want.emplace_back(n, 0);

      contact_facing(view, 0.25f, got[0].begin());
      contact_facing_ref(view, 0.25f, want[0].begin());
      CHECK(worst(got[0], want[0], n, 2e-6) <= 1);

      // Rounding of r x N is 2^-24 |r|, and |r| up to 1 is divided by l0 at least.
      for (const float l0 : {1e-3f, 0.1f}) {
        for (const float lever : {0.0f, 0.2f}) {
          torque_directions(view, l0, lever, got[1].begin(), got[2].begin(), got[3].begin());
          torque_directions_ref(view, l0, lever, want[1].begin(), want[2].begin(), want[3].begin());
          for (std::size_t k = 1; k <= 3; ++k) CHECK(worst(got[k], want[k], n, 3e-7 / l0) <= 1);
        }
      }
      const float* const depth = c.column[9].begin();
      series_gap(view, depth, 1e-3, u, got[4].begin());
      series_gap_ref(view, depth, 1e-3, u, want[4].begin());
      CHECK(worst(got[4], want[4], n, 1e-9) <= 1);

      // Slacks of none, below the touch and above it.
      const auto slack = [](std::size_t i) { return i % 3 ? static_cast<float>(i) * 2e-5f : 0.0f; };
      const float touch = n % 2 ? 4e-4f : 0.0f;
      for (auto* const out : {&got, &want}) {
        Column &kappa = (*out)[3], &left = (*out)[4];
        for (std::size_t i = 0; i < n; ++i)
          kappa[i] = static_cast<float>(i % 5), left[i] = slack(i);
        const SeriesLoads loads{kappa.begin(),     left.begin(),      depth,
                                (*out)[5].begin(), (*out)[6].begin(), n};
        out == &got ? series_loads(loads, touch) : series_loads_ref(loads, touch);
      }
      for (std::size_t k = 3; k <= 6; ++k) {
        CHECK(same_bits(got[k].begin(), want[k].begin(), n));
        CHECK(got[k].padding_untouched());
      }
      for (std::size_t i = 0; i < n; ++i) {
        const double u = slack(i), w = touch, kappa = static_cast<double>(i % 5);
        const double stiffness = u < w ? kappa * u / w : kappa;
        const double load = kappa * (u < w ? u * u / (2 * w) : u - w / 2);
        CHECK(got[3][i] == h6::test::near(stiffness).epsilon(1e-6));
        CHECK(std::fabs(got[5][i] - load) <= 1e-6 * load);
      }
    }
  });
}

TEST_CASE("contact_columns: firmness agrees with the reference on every target and count") {
  constexpr Firmness kRule{1e-4f, 5e-4f, 4, 16};
  on_every_target([&](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Random random(30 + n);
      Column depth(n, n % 4), got(n, 1), want(n, 2), rho(n, 3), rho_want(n, 0);
      for (std::size_t i = 0; i < n; ++i) {
        depth[i] = float(random.uniform(-1e-4, 7e-4));
        got[i] = want[i] = float(random.uniform(-2e-4, 3e-4));
      }
      firmness(depth.begin(), n, kRule, got.begin(), rho.begin());
      firmness_ref(depth.begin(), n, kRule, want.begin(), rho_want.begin());
      CHECK(same_bits(got.begin(), want.begin(), n));
      for (std::size_t i = 0; i < n; ++i) CHECK(std::fabs(rho[i] - rho_want[i]) < 1e-4f);
      CHECK(got.padding_untouched());
      CHECK(rho.padding_untouched());
    }
  });
}

namespace {

constexpr int kCross[7][3] = {{0, 0, 0},  {1, 0, 0}, {-1, 0, 0}, {0, 1, 0},
                              {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

// Distances of a plane or of a ball around contacts, in a field that is turned.
struct CrossColumns {
  std::vector<Column> at;
  Crosses crosses{{}, 3.0f, {}, {0, -1, 0, 1, 0, 0, 0, 0, 1}};
  CrossColumns(std::size_t n, std::size_t shift, float step) {
    crosses.step = step;
    Random random(7 + n);
    for (std::size_t k = 0; k < 7; ++k) at.emplace_back(n, shift + k);
    for (std::size_t i = 0; i < n; ++i) {
      double slope[3];
      random.direction(slope);
      const double here = random.uniform(-3, 0.5), bend = random.uniform(-1, 1);
      for (std::size_t k = 0; k < 7; ++k) {
        double d = here + (k > 0 ? 0.5 * step * step * bend : 0);
        for (int axis = 0; axis < 3; ++axis) d += step * kCross[k][axis] * slope[axis];
        at[k][i] = float(d);
      }
    }
    for (std::size_t k = 0; k < 7; ++k) crosses.at[k] = at[k].begin();
  }
};

}  // namespace

TEST_CASE("contact_columns: directions of push agree with the reference on every target") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c(n, n % 4);
      CrossColumns a(n, n % 3, n % 2 == 0 ? 0.5f : 0.125f);
      for (const Crosses* crosses : std::initializer_list<const Crosses*>{nullptr, &a.crosses}) {
        std::vector<Column> got, want;
        for (std::size_t k = 0; k < 4; ++k) got.emplace_back(n, k), want.emplace_back(n, 0);
        push_directions(c.view(), crosses, got[0].begin(), got[1].begin(), got[2].begin(),
                        got[3].begin());
        push_directions_ref(c.view(), crosses, want[0].begin(), want[1].begin(), want[2].begin(),
                            want[3].begin());
        // A direction may be the small difference of N and three times G, and the curvature divides
        // differences of distances by the square of the step.
        const double step = a.crosses.step, most = 5e-6 * 0.25 / (step * step);
        for (std::size_t k = 0; k < 4; ++k) CHECK(worst(got[k], want[k], n, most) <= 1);
        for (std::size_t i = 0; i < n; ++i) {
          double length2 = 0, along = 0;
          for (std::size_t k = 0; k < 3; ++k) {
            length2 += double{got[k][i]} * got[k][i];
            along += double{got[k][i]} * c.column[k][i];
          }
          CHECK(std::fabs(length2 - 1) < 1e-5);
          CHECK(along > 0);  // never into the part
        }
      }
    }
  });
}

TEST_CASE(
    "contact_columns: a push follows a flat field and a flat part, whichever is the flatter") {
  const float n[3] = {1, 0, 0}, g[3] = {0, 0, 1}, zero[3] = {0, 0, 0};
  const ContactColumns one{n, n + 1, n + 2, g, g + 1, g + 2, zero, zero, zero, 1};
  const auto push_of = [&](double bend) {
    float at[7], to[3], facing;
    for (int k = 0; k < 7; ++k)
      at[k] = float(-0.2 + 0.5 * kCross[k][2] + (k > 0 ? 0.25 * bend / 6 : 0));
    const Crosses crosses{{at, at + 1, at + 2, at + 3, at + 4, at + 5, at + 6},
                          3.0f,
                          {},
                          {1, 0, 0, 0, 1, 0, 0, 0, 1},
                          0.5f};
    push_directions_ref(one, &crosses, to, to + 1, to + 2, &facing);
    CHECK(facing == 1);  // an edge without a normal along the push still pushes
    return double{to[2]};
  };
  CHECK(push_of(0) > 0.94);  // a knife edge on a block: mostly along the block's gradient
  CHECK(push_of(8) < 0.2);   // a block on a knife edge: mostly along the block's normal
  for (double bend = 0; bend < 8; bend += 0.5) CHECK(push_of(bend + 0.5) < push_of(bend));
}

TEST_CASE("contact_columns: nothing pushes along a prism, however the lattice lies about it") {
  // A contact at an edge or a groove that runs along z. The field's third axis is z, too, and the
  // other two are turned. Four distances at the corners of a tetrahedron take the curvature for a
  // slope along z.
  const float n[3] = {1, 0, 0}, g[3] = {1, 0, 0}, zero[3] = {0, 0, 0};
  const ContactColumns one{n, n + 1, n + 2, g, g + 1, g + 2, zero, zero, zero, 1};
  on_every_target([&](const std::string&) {
    for (double turn = 0; turn < 6.3; turn += 0.1)
      for (const double curvature : {-1.0, 0.3, 2.0})
        for (const float step : {0.125f, 0.5f}) {
          const double c = std::cos(turn), s = std::sin(turn);
          float at[7], to[3], facing;
          for (int k = 0; k < 7; ++k) {
            // In the world's axes the slope is along x, the curvature along y.
            const double u = step * kCross[k][0], v = step * kCross[k][1];
            const double x = c * u - s * v, y = s * u + c * v;
            at[k] = float(-0.1 + x + 0.5 * curvature * y * y);
          }
          const Crosses crosses{{at, at + 1, at + 2, at + 3, at + 4, at + 5, at + 6},
                                3.0f,
                                {},
                                {float(c), float(-s), 0, float(s), float(c), 0, 0, 0, 1},
                                step};
          push_directions(one, &crosses, to, to + 1, to + 2, &facing);
          CHECK(facing == 1);
          CHECK(to[0] > 0.999);
          CHECK(std::fabs(to[1]) < 1e-5);
          CHECK(std::fabs(to[2]) < 1e-5);
        }
  });
}

TEST_CASE("contact_columns: a torque direction is square to its normal, of length 1 without l0") {
  Contacts c(500, 1);
  const ContactColumns view = c.view();
  Column t[3] = {Column(500, 0), Column(500, 1), Column(500, 2)};
  on_every_target([&](const std::string&) {
    torque_directions(view, 0, 0, t[0].begin(), t[1].begin(), t[2].begin());
    for (std::size_t i = 0; i < c.count; ++i) {
      if (i % 9 == 4) continue;  // no direction: the arm is along the normal
      double dot = 0, length2 = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += double{t[k][i]} * c.column[k][i], length2 += double{t[k][i]} * t[k][i];
      CHECK(std::fabs(dot) < 1e-4);
      CHECK(std::fabs(length2 - 1) < 1e-6);
    }
    // No arm, no direction.
    const float zero[3] = {0, 0, 0}, n[3] = {1, 0, 0};
    const ContactColumns one{n, n + 1, n + 2, n, n + 1, n + 2, zero, zero, zero, 1};
    torque_directions(one, 0, 0, t[0].begin(), t[1].begin(), t[2].begin());
    for (Column& column : t) CHECK(column[0] == 0.0f);
  });
}
