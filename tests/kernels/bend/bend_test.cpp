// SPDX-License-Identifier: Apache-2.0
// bend_test.cpp - bent points, spheres and rows, the reduced force and the sums over rows: SIMD
// against the reference, and the properties that the engine relies on.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kernels/bend/bend_points.h"
#include "kernels/bend/bend_sums.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

void fill(Column& column, std::size_t count, Random& random, double size) {
  for (std::size_t i = 0; i < count; ++i) column[i] = float(random.uniform(-size, size));
}

// Rest columns, modes and q of `vectors` vectors, the spread (of spheres) not negative.
struct Bent {
  std::size_t vectors, count, axes;
  std::vector<Column> rest, out;
  Column modes;
  std::vector<float> q;
  Bent(std::size_t n, std::size_t r, std::size_t a, std::size_t shift)
      : vectors(n), count(r), axes(a), modes(n * r * a * kBendLanes, shift), q(r) {
    Random random(5 + 100 * n + r);
    for (std::size_t k = 0; k < axes; ++k) {
      rest.emplace_back(kBendLanes * n, (shift + k) % 5);
      out.emplace_back(kBendLanes * n, (shift + 2 * k) % 5);
      fill(rest[k], kBendLanes * n, random, 1);
    }
    fill(modes, n * r * a * kBendLanes, random, 0.3);
    for (float& value : q) value = float(random.uniform(-1, 1));
    for (std::size_t v = 0; a == 4 && v < n; ++v)
      for (std::size_t i = 0; i < kBendLanes; ++i) {
        rest[3][v * kBendLanes + i] = std::fabs(rest[3][v * kBendLanes + i]);
        for (std::size_t j = 0; j < r; ++j) {
          float& spread = modes[((v * r + j) * 4 + 3) * kBendLanes + i];
          spread = std::fabs(spread);
        }
      }
  }
  ModesView view() { return {modes.begin(), count}; }
  const float* in(std::size_t k) { return rest[k].begin(); }
  float* to(std::size_t k) { return out[k].begin(); }
};

template <class Run>
void check_twins(std::size_t axes, const Run& run) {
  on_every_target([&](const std::string&) {
    for (const std::size_t r : {1u, 2u, 7u, 20u, 64u})
      for (std::size_t n = 0; n <= 5; ++n) {
        CAPTURE(r);
        CAPTURE(n);
        Bent got(n, r, axes, n % 4), want(n, r, axes, n % 4);
        run(got, false);
        run(want, true);
        for (std::size_t k = 0; k < axes; ++k) {
          CHECK(got.out[k].padding_untouched());
          for (std::size_t i = 0; i < kBendLanes * n; ++i)
            CHECK(std::fabs(got.out[k][i] - want.out[k][i]) <= 4e-6f);
        }
      }
  });
}

}  // namespace

TEST_CASE("bend_points and bend_normals: SIMD agrees with the reference for every count of modes") {
  for (const bool unit : {false, true})
    check_twins(3, [&](Bent& b, bool reference) {
      const float* const rest[3] = {b.in(0), b.in(1), b.in(2)};
      float* const to[3] = {b.to(0), b.to(1), b.to(2)};
      const auto run = unit ? (reference ? bend_normals_ref : bend_normals)
                            : (reference ? bend_points_ref : bend_points);
      run(b.view(), b.q.data(), rest, nullptr, b.vectors, to);
    });
}

TEST_CASE("bend_spheres and bend_reach: SIMD agrees with the reference") {
  check_twins(4, [](Bent& b, bool reference) {
    const float* const rest[4] = {b.in(0), b.in(1), b.in(2), b.in(3)};
    float* const to[4] = {b.to(0), b.to(1), b.to(2), b.to(3)};
    (reference ? bend_spheres_ref : bend_spheres)(b.view(), b.q.data(), rest, nullptr, b.vectors,
                                                  to);
    const float reach = bend_reach(b.view(), b.q.data(), b.vectors);
    CHECK(reach == doctest::Approx(bend_reach_ref(b.view(), b.q.data(), b.vectors)).epsilon(1e-5));
    CHECK((reach > 0) == (b.vectors > 0));
  });
}

TEST_CASE("bend_points: only the vectors of the list are written") {
  Bent b(5, 3, 3, 0);
  const float* const rest[3] = {b.in(0), b.in(1), b.in(2)};
  float* const to[3] = {b.to(0), b.to(1), b.to(2)};
  const std::uint32_t list[2] = {1, 4};
  bend_points(b.view(), b.q.data(), rest, list, 2, to);
  for (std::size_t i = 0; i < 5 * kBendLanes; ++i)
    CHECK(std::isnan(b.out[1][i]) == (i / kBendLanes != 1 && i / kBendLanes != 4));
}

TEST_CASE("bend_spheres: a sphere that held points at rest holds them bent by any q") {
  Random random(9);
  for (int round = 0; round < 200; ++round) {
    constexpr std::size_t kModes = 12, kInside = 20;
    std::vector<float> modes(kModes * 4 * kBendLanes), q(kModes);
    std::vector<float> rest[4], bent[4];
    for (auto* columns : {rest, bent})
      for (int k = 0; k < 4; ++k) columns[k].assign(kBendLanes, 0);
    std::vector<double> at(3 * kInside), carried(3 * kInside * kModes);
    for (double& v : at) v = random.uniform(-0.1, 0.1);
    for (double& v : carried) v = random.uniform(-0.2, 0.2);
    for (float& v : q) v = float(random.uniform(-2, 2));
    double radius = 0;
    for (std::size_t i = 0; i < kInside; ++i)
      radius = std::max(radius, std::hypot(at[3 * i], at[3 * i + 1], at[3 * i + 2]));
    rest[3][0] = float(radius * 1.000001);
    for (std::size_t j = 0; j < kModes; ++j) {
      float centre[3];
      for (int k = 0; k < 3; ++k)
        centre[k] = modes[(j * 4 + std::size_t(k)) * kBendLanes] = float(random.uniform(-1, 1));
      double spread = 0;
      for (std::size_t i = 0; i < kInside; ++i) {
        double d[3];
        for (int k = 0; k < 3; ++k) {
          double& u = carried[(i * kModes + j) * 3 + std::size_t(k)];
          d[k] = u, u += double(centre[k]);
        }
        spread = std::max(spread, std::hypot(d[0], d[1], d[2]));
      }
      modes[(j * 4 + 3) * kBendLanes] = float(spread * 1.000001);
    }
    const float* const from[4] = {rest[0].data(), rest[1].data(), rest[2].data(), rest[3].data()};
    float* const to[4] = {bent[0].data(), bent[1].data(), bent[2].data(), bent[3].data()};
    bend_spheres({modes.data(), kModes}, q.data(), from, nullptr, 1, to);
    const float reach = bend_reach({modes.data(), kModes}, q.data(), 1);
    for (std::size_t i = 0; i < kInside; ++i) {
      double d[3], way[3] = {};
      for (int k = 0; k < 3; ++k) {
        for (std::size_t j = 0; j < kModes; ++j)
          way[k] += double(q[j]) * carried[(i * kModes + j) * 3 + std::size_t(k)];
        d[k] = at[3 * i + std::size_t(k)] + way[k] - double(bent[std::size_t(k)][0]);
      }
      CHECK(std::hypot(d[0], d[1], d[2]) <= double(bent[3][0]));
      CHECK(std::hypot(way[0], way[1], way[2]) <= double(reach));
    }
  }
}

TEST_CASE("contact_rows: SIMD agrees with the reference for every count, misaligned") {
  on_every_target([](const std::string&) {
    for (const std::size_t r : {1u, 20u, 64u})
      for (std::size_t n = 0; n <= 67; ++n) {
        CAPTURE(n);
        Random random(n + r);
        Bent b(9, r, 3, n % 3);
        std::vector<Column> c;
        for (std::size_t k = 0; k < 6; ++k) {
          c.emplace_back(n, (n + k) % 4);
          fill(c[k], n, random, 1);
        }
        std::vector<std::uint32_t> row;
        for (std::uint32_t i = 0; i < 9 * kBendLanes && row.size() < n; ++i)
          if (i % 3 != 1 || i > 9) row.push_back(i);
        float turn[9];
        for (float& v : turn) v = float(random.uniform(-1, 1));
        const std::size_t stride = (6 + r + 7) / 8 * 8;
        Column got(n * stride, n % 5), want(n * stride, n % 5);
        const BentContacts contacts{c[0].begin(), c[1].begin(), c[2].begin(), c[3].begin(),
                                    c[4].begin(), c[5].begin(), row.data(),   row.size()};
        contact_rows(contacts, b.view(), turn, stride, got.begin());
        contact_rows_ref(contacts, b.view(), turn, stride, want.begin());
        CHECK(got.padding_untouched());
        for (std::size_t i = 0; i < row.size() * stride; ++i)
          CHECK(std::fabs(got[i] - want[i]) <= 2e-6f);
      }
  });
}

TEST_CASE("reduced_force: SIMD agrees with the reference, and the tangent is the derivative") {
  for (const std::size_t r : {1u, 3u, 8u, 20u}) {
    CAPTURE(r);
    Random random(r);
    ReducedForce p{nullptr, r};
    std::vector<double> coefficients(p.padded() * p.monomials()), q(r);
    for (double& c : coefficients) c = random.uniform(-1, 1);
    p.coefficients = coefficients.data();
    for (double& v : q) v = random.uniform(-1, 1);
    const auto force_at = [&](const std::vector<double>& x) {
      std::vector<double> f(p.padded()), K(r * p.padded());
      reduced_force_ref(p, x.data(), f.data(), K.data());
      return f;
    };
    std::vector<double> f(p.padded()), K(r * p.padded());
    reduced_force_ref(p, q.data(), f.data(), K.data());
    for (std::size_t m = 0; m < r; ++m) {
      constexpr double h = 1e-3;  // a difference of fourth order is exact for cubics
      const auto moved = [&](double by) {
        std::vector<double> x = q;
        x[m] += by;
        return force_at(x);
      };
      const auto a = moved(h), b = moved(-h), c = moved(2 * h), d = moved(-2 * h);
      for (std::size_t i = 0; i < r; ++i) {
        const double slope = (8 * (a[i] - b[i]) - (c[i] - d[i])) / (12 * h);
        CHECK(K[m * p.padded() + i] == doctest::Approx(slope).epsilon(1e-9).scale(double(r)));
      }
    }
    on_every_target([&](const std::string&) {
      std::vector<double> got_f(p.padded(), 7), got_K(r * p.padded(), 7);
      reduced_force(p, q.data(), got_f.data(), got_K.data());
      for (std::size_t i = 0; i < f.size(); ++i) CHECK(std::fabs(got_f[i] - f[i]) < 1e-11);
      for (std::size_t i = 0; i < K.size(); ++i) CHECK(std::fabs(got_K[i] - K[i]) < 1e-11);
    });
  }
}

TEST_CASE("sum_rows: SIMD agrees with the reference for every count, misaligned") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      CAPTURE(n);
      Random random(n);
      constexpr std::size_t kSize = 11, kStride = 16;
      Column left(n * kStride, n % 4), right(n * kStride, n % 3), load(n, 1), share(n, 2);
      fill(left, n * kStride, random, 1), fill(right, n * kStride, random, 1);
      fill(load, n, random, 1), fill(share, n, random, 1);
      const RowSums rows{left.begin(), right.begin(), load.begin(), share.begin(), n,
                         kSize,        kStride};
      std::vector<double> f(kStride), m(kSize * kStride), f_ref = f, m_ref = m;
      sum_rows(rows, f.data(), m.data());
      sum_rows_ref(rows, f_ref.data(), m_ref.data());
      for (std::size_t i = 0; i < f.size(); ++i) CHECK(std::fabs(f[i] - f_ref[i]) < 1e-12);
      for (std::size_t i = 0; i < m.size(); ++i) CHECK(std::fabs(m[i] - m_ref[i]) < 1e-12);
    }
  });
}
