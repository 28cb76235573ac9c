// SPDX-License-Identifier: Apache-2.0
// contact_wrench_test.cpp - the wrench of contacts and its derivatives.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "kernels/contact/contact_wrench.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

using Vec = std::array<double, 3>;

Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct Contacts {
  Contacts(std::size_t n, std::size_t shift) : count(n) {
    for (std::size_t k = 0; k < 11; ++k) column.emplace_back(n, (shift + k) % 7);
  }
  WrenchColumns view() {
    const auto p = [&](int k) { return column[k].begin(); };
    return {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), p(8), p(9), p(10), count};
  }
  std::vector<Column> column;  // in the order of WrenchColumns
  std::size_t count;
};

Contacts random_contacts(std::size_t n, std::size_t shift, std::uint64_t seed) {
  Random random(seed);
  Contacts c(n, shift);
  for (std::size_t i = 0; i < n; ++i) {
    double normal[3], gradient[3];
    random.direction(normal);
    random.direction(gradient);
    c.column[0][i] = float(random.uniform(0, 1e-3));
    c.column[1][i] = float(random.uniform(0, 1));
    for (int k = 0; k < 3; ++k) {
      c.column[2 + k][i] = float(normal[k]);
      c.column[5 + k][i] = float(gradient[k]);
      c.column[8 + k][i] = float(random.uniform(-0.1, 0.1));
    }
  }
  return c;
}

// Contacts separate at up to 3 m/s here: with beta = 1e-3 s a part of them would pull.
constexpr WrenchParameters kMoving = {1e4, 1e-3, {0.3, -0.2, 0.1, 4.0, -3.0, 2.0}, true};

// Largest difference of two sums against the sum of magnitudes of what was added.
double difference(const WrenchSum& a, const WrenchSum& b, Contacts& c, const WrenchParameters& p) {
  double force = 0, stiffness = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    force += p.stiffness * c.column[1][i] * (c.column[0][i] + p.damping * 10);
    stiffness += p.stiffness * c.column[1][i];
  }
  double worst = 0;
  for (int k = 0; k < 6; ++k) {
    worst = std::max(worst, std::fabs(a.force[k] - b.force[k]) / std::max(force, 1e-30));
    worst = std::max(worst, std::fabs(a.elastic[k] - b.elastic[k]) / std::max(force, 1e-30));
  }
  for (int k = 0; k < 36; ++k) {
    const double s = std::max(stiffness, 1e-30);
    worst = std::max(worst, std::fabs(a.stiffness[k] - b.stiffness[k]) / s);
    worst = std::max(worst, std::fabs(a.damping[k] - b.damping[k]) / s);
  }
  return worst;
}

bool same(const WrenchSum& a, const WrenchSum& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// Contacts of a rigid body against planes: depth_i = -(g_i.p_i - h_i), exact under rigid motion.
struct PlaneContacts {
  std::vector<Vec> arm, normal, gradient;
  std::vector<double> depth, weight;

  explicit PlaneContacts(std::size_t n) {
    Random random(17);
    for (std::size_t i = 0; i < n; ++i) {
      double v[3], g[3];
      random.direction(v);
      random.direction(g);
      normal.push_back({v[0], v[1], v[2]});
      gradient.push_back({g[0], g[1], g[2]});
      arm.push_back(
          {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)});
      depth.push_back(random.uniform(2e-4, 1e-3));
      weight.push_back(random.uniform(0.1, 1));
    }
  }

  // The same contacts after the body moved by dx and turned by the vector turn, weights frozen.
  PlaneContacts moved(const Vec& dx, const Vec& turn) const {
    PlaneContacts m = *this;
    const double angle = std::sqrt(dot(turn, turn));
    for (std::size_t i = 0; i < arm.size(); ++i) {
      m.arm[i] = rotate(arm[i], turn, angle);
      m.normal[i] = rotate(normal[i], turn, angle);
      Vec shift;
      for (int k = 0; k < 3; ++k) shift[k] = dx[k] + m.arm[i][k] - arm[i][k];
      m.depth[i] = depth[i] - dot(gradient[i], shift);
    }
    return m;
  }

  WrenchSum sum(const WrenchParameters& p) const {
    std::vector<double> c[9];
    for (int k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < arm.size(); ++i) {
        c[k].push_back(normal[i][k]);
        c[3 + k].push_back(gradient[i][k]);
        c[6 + k].push_back(arm[i][k]);
      }
    }
    const WrenchColumnsT<double> view{depth.data(), weight.data(), c[0].data(), c[1].data(),
                                      c[2].data(),  c[3].data(),   c[4].data(), c[5].data(),
                                      c[6].data(),  c[7].data(),   c[8].data(), arm.size()};
    return contact_wrench_ref(view, p, 0, arm.size());
  }

 private:
  static Vec rotate(const Vec& v, const Vec& turn, double angle) {
    if (angle == 0) return v;
    const Vec axis = {turn[0] / angle, turn[1] / angle, turn[2] / angle};
    const Vec c = cross(axis, v);
    const double along = dot(axis, v) * (1 - std::cos(angle));
    Vec out;
    for (int k = 0; k < 3; ++k) {
      out[k] = v[k] * std::cos(angle) + c[k] * std::sin(angle) + axis[k] * along;
    }
    return out;
  }
};

}  // namespace

TEST_CASE("contact_wrench: SIMD agrees with the reference on every target, count and alignment") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      for (bool exact : {false, true}) {
        Contacts c = random_contacts(n, n, 30 + n);
        WrenchParameters p = kMoving;
        p.exact = exact;
        const WrenchSum want = contact_wrench_ref(c.view(), p, 0, n);
        CHECK(difference(contact_wrench(c.view(), p, 0, n), want, c, p) <= 1e-13);
      }
    }
    Contacts c = random_contacts(2000, 1, 3);
    const WrenchSum want = contact_wrench_ref(c.view(), kMoving, 0, c.count);
    CHECK(difference(contact_wrench(c.view(), kMoving, 0, c.count), want, c, kMoving) <= 1e-13);
  });
}

TEST_CASE(
    "contact_wrench: a slice depends on its contacts alone, not on where they lie in memory") {
  on_every_target([](const std::string&) {
    Contacts c = random_contacts(300, 0, 6), shifted = random_contacts(300, 3, 6);
    for (std::size_t b : {0u, 1u, 5u, 130u}) {
      const WrenchSum whole = contact_wrench(c.view(), kMoving, b, 300);
      CHECK(same(whole, contact_wrench(shifted.view(), kMoving, b, 300)));
      Contacts tail(300 - b, 2);
      for (std::size_t k = 0; k < 11; ++k) {
        for (std::size_t i = b; i < 300; ++i) tail.column[k][i - b] = c.column[k][i];
      }
      CHECK(same(whole, contact_wrench(tail.view(), kMoving, 0, 300 - b)));
    }
  });
}

TEST_CASE("contact_wrench: contacts that carry nothing may be most of them, wherever they are") {
  on_every_target([](const std::string&) {
    for (const bool still : {false, true}) {
      for (const std::size_t apart : {2, 7, 16, 61, 700}) {
        Contacts c = random_contacts(700, 3, 40 + apart);
        WrenchParameters p = kMoving;
        if (still) p.damping = 0;
        // Contacts lose their load by their weight or by their depth.
        for (std::size_t i = 0; i < c.count; ++i)
          if (i % apart != apart / 2) c.column[i / 32 % 2][i] = 0;
        for (const bool exact : {false, true}) {
          p.exact = exact;
          const WrenchSum want = contact_wrench_ref(c.view(), p, 0, c.count);
          CHECK(difference(contact_wrench(c.view(), p, 0, c.count), want, c, p) <= 1e-13);
        }
      }
    }
  });
}

TEST_CASE("contact_wrench: slices add up to the whole") {
  on_every_target([](const std::string&) {
    Contacts c = random_contacts(500, 2, 8);
    WrenchSum sum;
    for (std::size_t b = 0; b < 500; b += 64) {
      sum.add(contact_wrench(c.view(), kMoving, b, std::min<std::size_t>(b + 64, 500)));
    }
    CHECK(difference(sum, contact_wrench(c.view(), kMoving, 0, 500), c, kMoving) <= 1e-14);
  });
}

TEST_CASE("contact_wrench: no contact pulls, and one that would is out of every sum") {
  on_every_target([](const std::string&) {
    Contacts c = random_contacts(200, 0, 10);
    int out = 0, in = 0;
    for (std::size_t i = 0; i < c.count; ++i) {
      const WrenchSum one = contact_wrench(c.view(), kMoving, i, i + 1);
      const Vec n = {c.column[2][i], c.column[3][i], c.column[4][i]};
      const Vec r = {c.column[8][i], c.column[9][i], c.column[10][i]};
      const Vec v = {0.3, -0.2, 0.1}, omega = {4.0, -3.0, 2.0};
      const double e = c.column[0][i] - kMoving.damping * (dot(n, v) + dot(cross(r, n), omega));
      const double along = one.force[0] * n[0] + one.force[1] * n[1] + one.force[2] * n[2];
      CHECK(along >= 0.0);
      ++(e > 0 ? in : out);
      CHECK(along ==
            h6::test::near(std::max(0.0, e) * kMoving.stiffness * c.column[1][i]).epsilon(1e-6));
      if (e <= 0) CHECK(same(one, WrenchSum{}));
    }
    CHECK(in > 20);
    CHECK(out > 20);
  });
}

TEST_CASE("contact_wrench: at rest the force is the elastic force") {
  on_every_target([](const std::string&) {
    Contacts c = random_contacts(70, 0, 11);
    const WrenchParameters p = {1e4, 1e-3, {}, true};
    const WrenchSum s = contact_wrench(c.view(), p, 0, 70);
    CHECK(std::memcmp(s.force, s.elastic, sizeof s.force) == 0);
  });
}

TEST_CASE("contact_wrench: with the geometric term K is the derivative of the elastic wrench") {
  const PlaneContacts contacts(60);
  const WrenchParameters p = {1e4, 0.0, {}, true};
  const WrenchSum s = contacts.sum(p);
  // df/dq = -K - [[0, [F]x], [0, [tau]x]], q = (x, theta), theta turning on the left.
  double derivative[36];
  for (int k = 0; k < 36; ++k) derivative[k] = -s.stiffness[k];
  for (int block = 0; block < 2; ++block) {
    const double* f = s.elastic + 3 * block;
    const double skew[3][3] = {{0, -f[2], f[1]}, {f[2], 0, -f[0]}, {-f[1], f[0], 0}};
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col)
        derivative[6 * (3 * block + row) + 3 + col] -= skew[row][col];
    }
  }
  double scale[2][2] = {}, worst = 0;
  for (int row = 0; row < 6; ++row) {
    for (int col = 0; col < 6; ++col) {
      scale[row / 3][col / 3] =
          std::max(scale[row / 3][col / 3], std::fabs(derivative[6 * row + col]));
    }
  }
  for (int col = 0; col < 6; ++col) {
    const double h = 1e-6;
    Vec dx{}, turn{};
    (col < 3 ? dx : turn)[col % 3] = h;
    const WrenchSum ahead = contacts.moved(dx, turn).sum(p);
    for (double& v : dx) v = -v;
    for (double& v : turn) v = -v;
    const WrenchSum behind = contacts.moved(dx, turn).sum(p);
    for (int row = 0; row < 6; ++row) {
      const double slope = (ahead.elastic[row] - behind.elastic[row]) / (2 * h);
      worst =
          std::max(worst, std::fabs(slope - derivative[6 * row + col]) / scale[row / 3][col / 3]);
    }
  }
  MESSAGE("relative error of the 6 x 6 derivative " << worst);
  CHECK(worst <= 1e-6);
}

TEST_CASE("contact_wrench: beta B is the derivative of the force by velocity") {
  const PlaneContacts contacts(60);
  WrenchParameters p = {1e4, 1e-4, {0.1, 0.2, -0.1, 1, -1, 0.5}, true};  // nothing is clamped
  const WrenchSum s = contacts.sum(p);
  for (int col = 0; col < 6; ++col) {
    WrenchParameters ahead = p, behind = p;
    ahead.velocity[col] += 1e-3;
    behind.velocity[col] -= 1e-3;
    const WrenchSum a = contacts.sum(ahead), b = contacts.sum(behind);
    for (int row = 0; row < 6; ++row) {
      const double slope = (a.force[row] - b.force[row]) / 2e-3;
      CHECK(slope == h6::test::near(-p.damping * s.damping[6 * row + col]).epsilon(1e-8));
    }
  }
}

TEST_CASE("contact_wrench: the symmetric form is J J^T: symmetric, K = B, and never negative") {
  on_every_target([](const std::string&) {
    Contacts c = random_contacts(90, 1, 12);
    WrenchParameters p = kMoving;
    p.exact = false;
    const WrenchSum s = contact_wrench(c.view(), p, 0, 90);
    CHECK(std::memcmp(s.stiffness, s.damping, sizeof s.damping) == 0);
    Random random(1);
    for (int row = 0; row < 6; ++row) {
      for (int col = 0; col < 6; ++col) CHECK(s.damping[6 * row + col] == s.damping[6 * col + row]);
    }
    for (int t = 0; t < 50; ++t) {
      double v[6], product = 0;
      for (double& x : v) x = random.uniform(-1, 1);
      for (int k = 0; k < 36; ++k) product += v[k / 6] * s.damping[k] * v[k % 6];
      CHECK(product >= 0.0);
    }
    // It does not read the gradient.
    for (int k = 5; k < 8; ++k) c.column[k][3] = std::numeric_limits<float>::quiet_NaN();
    CHECK(same(s, contact_wrench(c.view(), p, 0, 90)));
  });
}
