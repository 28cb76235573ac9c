// SPDX-License-Identifier: Apache-2.0
// warp_test.cpp - warped points, normals, spheres and rows: SIMD against the reference, and the
// properties of the mean rotation that the engine relies on.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "kernels/bend/bend_sums.h"
#include "kernels/bend/mean_rotation.h"
#include "kernels/bend/warp_points.h"
#include "tests/kernels/kernel_test.h"

using namespace h6;
using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

void fill(Column& column, std::size_t count, Random& random, double size) {
  for (std::size_t i = 0; i < count; ++i) column[i] = float(random.uniform(-size, size));
}

// Columns of `vectors` vectors, modes and q. Turns are of the order of `turn` rad.
struct Warped {
  std::size_t vectors, count;
  std::vector<Column> rest, out;
  Column modes;
  std::vector<float> q;
  Warped(std::size_t n, std::size_t r, std::size_t axes, double turn, std::size_t shift)
      : vectors(n), count(r), modes(n * r * axes * kBendLanes, shift), q(r) {
    Random random(5 + 100 * n + r);
    for (std::size_t k = 0; k < 4; ++k) {
      rest.emplace_back(kBendLanes * n, (shift + k) % 5);
      fill(rest[k], kBendLanes * n, random, 1);
    }
    for (std::size_t k = 0; k < 9; ++k) out.emplace_back(kBendLanes * n, (shift + 2 * k) % 5);
    fill(modes, n * r * axes * kBendLanes, random, 0.3);
    for (float& value : q) value = float(random.uniform(-1, 1));
    for (std::size_t i = 0; i < kBendLanes * n; ++i) rest[3][i] = std::fabs(rest[3][i]);
    for (std::size_t row = 0; row < n * r; ++row)
      for (std::size_t axis = 3; axis < axes; ++axis)
        for (std::size_t i = 0; i < kBendLanes; ++i) {
          float& value = modes[(row * axes + axis) * kBendLanes + i];
          value = axis < 6 ? value * float(turn) : std::fabs(value);
        }
  }
  ModesView view() { return {modes.begin(), count}; }
};

using Run = void (*)(Warped&, bool reference);

// `columns` of the output are written.
void check_twins(std::size_t axes, std::size_t columns, const Run& run) {
  on_every_target([&](const std::string&) {
    for (const double turn : {0.0, 1.0, 6.0})  // on both sides of kSeriesEnd, and in one register
      for (const std::size_t r : {1u, 2u, 7u, 20u, 64u})
        for (std::size_t n = 0; n <= 5; ++n) {
          CAPTURE(turn);
          CAPTURE(r);
          CAPTURE(n);
          Warped got(n, r, axes, turn, n % 4), want(n, r, axes, turn, n % 4);
          run(got, false);
          run(want, true);
          for (std::size_t k = 0; k < columns; ++k) {
            CHECK(got.out[k].padding_untouched());
            for (std::size_t i = 0; i < kBendLanes * n; ++i)
              CHECK(std::fabs(got.out[k][i] - want.out[k][i]) <=
                    1e-5f * std::max(1.0f, std::fabs(want.out[k][i])));
          }
        }
  });
}

template <std::size_t n>
std::array<float*, n> pointers(std::vector<Column>& columns) {
  std::array<float*, n> out;
  for (std::size_t k = 0; k < n; ++k) out[k] = columns[k].begin();
  return out;
}

h6Vec3 any(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}
// The mean of rotations by sums of Gauss over eight pieces, from the quaternions of vector.h.
h6Vec3 mean_turn(const h6Vec3& w, const h6Vec3& u) {
  h6Vec3 sum{};
  constexpr double kNode[3] = {0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417};
  constexpr double kShare[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  constexpr int kPieces = 64;
  for (int piece = 0; piece < kPieces; ++piece)
    for (int k = 0; k < 3; ++k)
      sum = sum + (kShare[k] / kPieces) * rotate(turn_by(((piece + kNode[k]) / kPieces) * w), u);
  return sum;
}
h6Vec3 warped(const h6Vec3& w, const h6Vec3& u) {
  const MeanRotation m = mean_rotation(dot(w, w));
  return m.a[0] * u + m.b[0] * cross(w, u) + (m.c[0] * dot(w, u)) * w;
}

}  // namespace

TEST_CASE("the mean rotation is the mean of rotations, on both sides of the end of its series") {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const double angle = i < 1000 ? random.uniform(0, 7) : 2 + random.uniform(-1e-3, 1e-3);
    double axis[3];
    random.direction(axis);
    const h6Vec3 w = angle * h6Vec3{axis[0], axis[1], axis[2]}, u = any(random, 1);
    CHECK(norm(warped(w, u) - mean_turn(w, u)) < 1e-10);
    CHECK(norm(warped(w, u)) <= norm(u) * (1 + 1e-12));
    const h6Vec3 other = w + any(random, i % 2 ? 3 : 1e-3);
    CHECK(norm(warped(w, u) - warped(other, u)) <=
          0.5 * norm(other - w) * norm(u) * (1 + 1e-6) + 1e-12);
  }
}

TEST_CASE("derivatives of the mean rotation's factors are those of central differences") {
  for (double s = 0.01; s < 60; s *= 1.07) {
    CAPTURE(s);
    const double h = 1e-3 * s;
    const auto check = [&](const double(MeanRotation::*factor)[3]) {
      const auto at = [&](int k, int derivative) {
        const MeanRotation m = mean_rotation(s + k * h);
        return (m.*factor)[derivative];
      };
      for (int n = 0; n < 2; ++n)
        CHECK(at(0, n + 1) ==
              doctest::Approx((8 * (at(1, n) - at(-1, n)) - (at(2, n) - at(-2, n))) / (12 * h))
                  .epsilon(1e-7));
    };
    check(&MeanRotation::a), check(&MeanRotation::b), check(&MeanRotation::c);
  }
}

TEST_CASE("warp_points, warp_normals and warp_spheres: SIMD agrees with the reference") {
  check_twins(6, 9, [](Warped& x, bool reference) {
    (reference ? warp_points_ref : warp_points)(x.view(), x.q.data(), pointers<3>(x.rest).data(),
                                                nullptr, x.vectors, pointers<9>(x.out).data());
  });
  // Modes of the points are turns of the normals here.
  check_twins(6, 3, [](Warped& x, bool reference) {
    const float* const turn[3] = {x.modes.begin(), x.rest[3].begin(), x.rest[1].begin()};
    (reference ? warp_normals_ref : warp_normals)(pointers<3>(x.rest).data(), turn, nullptr,
                                                  x.vectors, pointers<3>(x.out).data());
  });
  check_twins(8, 4, [](Warped& x, bool reference) {
    (reference ? warp_spheres_ref : warp_spheres)(x.view(), x.q.data(), pointers<4>(x.rest).data(),
                                                  nullptr, x.vectors, pointers<4>(x.out).data());
    const WarpReach got = warp_reach(x.view(), x.q.data(), x.rest[3].begin(), x.vectors),
                    want = warp_reach_ref(x.view(), x.q.data(), x.rest[3].begin(), x.vectors);
    CHECK(got.shift == doctest::Approx(want.shift).epsilon(1e-5));
    CHECK(got.turn == doctest::Approx(want.turn).epsilon(1e-5));
    CHECK((got.shift > 0) == (x.vectors > 0));
  });
}

TEST_CASE(
    "warp_points: only the vectors of the list are written; without turns bits are the same") {
  Warped x(5, 3, 6, 0, 0);
  const std::uint32_t list[2] = {1, 4};
  warp_points(x.view(), x.q.data(), pointers<3>(x.rest).data(), list, 2, pointers<9>(x.out).data());
  std::vector<float> plain;
  for (std::size_t row = 0; row < 5 * 3; ++row)
    for (std::size_t i = 0; i < 3 * kBendLanes; ++i)
      plain.push_back(x.modes[row * 6 * kBendLanes + i]);
  Warped want(5, 3, 6, 0, 0);
  bend_points({plain.data(), 3}, x.q.data(), pointers<3>(x.rest).data(), list, 2,
              pointers<3>(want.out).data());
  for (std::size_t i = 0; i < 5 * kBendLanes; ++i) {
    const bool listed = i / kBendLanes == 1 || i / kBendLanes == 4;
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(std::isnan(x.out[k][i]) == !listed);
      if (listed) CHECK(x.out[k][i] == want.out[k][i]);
    }
  }
}

TEST_CASE("warp_points and warp_normals: modes that are small turns turn a body as a whole") {
  // u_j = e_j x p, w_j = e_j.
  Random random(3);
  Warped x(2, 3, 6, 1, 1);
  const double h[3] = {0.9, -1.7, 1.1};
  for (std::size_t i = 0; i < 2 * kBendLanes; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const h6Vec3 p{x.rest[0][i], x.rest[1][i], x.rest[2][i]};
      const h6Vec3 e{double(j == 0), double(j == 1), double(j == 2)}, u = cross(e, p);
      for (int k = 0; k < 3; ++k) {
        const std::size_t at = ((i / kBendLanes * 3 + j) * 6 + std::size_t(k)) * kBendLanes;
        x.modes[at + i % kBendLanes] = float(component(u, k));
        x.modes[at + 3 * kBendLanes + i % kBendLanes] = float(component(e, k));
      }
    }
  for (std::size_t j = 0; j < 3; ++j) x.q[j] = float(h[j]);
  const h6Quat turn = turn_by({double(x.q[0]), double(x.q[1]), double(x.q[2])});
  warp_points(x.view(), x.q.data(), pointers<3>(x.rest).data(), nullptr, 2,
              pointers<9>(x.out).data());
  const float* const w[3] = {x.out[6].begin(), x.out[7].begin(), x.out[8].begin()};
  Warped normals(2, 3, 6, 1, 0);
  warp_normals(pointers<3>(x.rest).data(), w, nullptr, 2, pointers<3>(normals.out).data());
  for (std::size_t i = 0; i < 2 * kBendLanes; ++i) {
    const h6Vec3 want = rotate(turn, {x.rest[0][i], x.rest[1][i], x.rest[2][i]});
    CHECK(norm(want - h6Vec3{x.out[0][i], x.out[1][i], x.out[2][i]}) < 2e-6);
    CHECK(norm(want - h6Vec3{normals.out[0][i], normals.out[1][i], normals.out[2][i]}) < 2e-6);
  }
}

TEST_CASE("warp_spheres: a sphere that held points at rest holds them warped by any q") {
  Random random(9);
  double tightest = 9;
  for (int round = 0; round < 300; ++round) {
    const std::size_t kModes = round % 2 ? 1 : 6, kInside = 20;
    // Fields that are smooth, turns that differ within the sphere, and ways that do.
    const double size = 0.1, noise = round % 4 == 1 ? 0.3 : 0, turn_noise = round % 4 ? 0.5 : 0;
    std::vector<h6Vec3> at(kInside), u(kInside * kModes), w(kInside * kModes);
    std::vector<float> modes(kModes * 8 * kBendLanes), q(kModes);
    std::vector<float> rest[4], bent[4];
    for (auto* columns : {rest, bent})
      for (int k = 0; k < 4; ++k) columns[k].assign(kBendLanes, 0);
    double radius = 0;
    for (h6Vec3& p : at) p = any(random, size), radius = std::max(radius, norm(p));
    rest[3][0] = float(radius * 1.000001);
    for (std::size_t j = 0; j < kModes; ++j) {
      q[j] = float(random.uniform(-2, 2));
      float middle[8] = {};
      for (int k = 0; k < 6; ++k) middle[k] = float(random.uniform(-0.5, 0.5));
      const h6Vec3 shift{middle[0], middle[1], middle[2]}, turn{middle[3], middle[4], middle[5]};
      for (std::size_t i = 0; i < kInside; ++i) {
        const h6Vec3 a = any(random, noise), b = any(random, turn_noise);
        u[i * kModes + j] = shift + cross(turn, at[i]) + a, w[i * kModes + j] = turn + b;
        middle[6] = std::max(middle[6], float(norm(a) * 1.000001));
        middle[7] = std::max(middle[7], float(norm(b) * 1.000001));
      }
      for (std::size_t k = 0; k < 8; ++k) modes[(j * 8 + k) * kBendLanes] = middle[k];
    }
    const float* const from[4] = {rest[0].data(), rest[1].data(), rest[2].data(), rest[3].data()};
    float* const to[4] = {bent[0].data(), bent[1].data(), bent[2].data(), bent[3].data()};
    warp_spheres({modes.data(), kModes}, q.data(), from, nullptr, 1, to);
    const WarpReach reach = warp_reach({modes.data(), kModes}, q.data(), rest[3].data(), 1);
    double farthest = 0;
    for (std::size_t i = 0; i < kInside; ++i) {
      h6Vec3 way{}, turned{};
      for (std::size_t j = 0; j < kModes; ++j)
        way = way + double(q[j]) * u[i * kModes + j],
        turned = turned + double(q[j]) * w[i * kModes + j];
      const h6Vec3 moved = mean_turn(turned, way);
      const double off = norm(at[i] + moved - h6Vec3{bent[0][0], bent[1][0], bent[2][0]});
      farthest = std::max(farthest, off);
      CHECK(off <= double(bent[3][0]));
      CHECK(norm(way) <= double(reach.shift));
      CHECK(norm(turned) <= double(reach.turn));
    }
    if (round % 4 == 0) tightest = std::min(tightest, farthest / double(bent[3][0]));
  }
  CHECK(tightest > 0.99);  // a sphere that only turns does not grow
}

TEST_CASE("warp_rows: SIMD agrees with the reference for every count, misaligned") {
  on_every_target([](const std::string&) {
    for (const double turn : {0.1, 6.0})
      for (const std::size_t r : {1u, 20u, 64u})
        for (std::size_t n = 0; n <= 67; ++n) {
          CAPTURE(n);
          Random random(n + r);
          Warped x(9, r, 6, 1, n % 3);
          std::vector<Column> c;
          for (std::size_t k = 0; k < 6; ++k)
            c.emplace_back(n, (n + k) % 4), fill(c[k], n, random, 1);
          for (std::size_t k = 0; k < 6; ++k)
            fill(x.out[k], 9 * kBendLanes, random, k < 3 ? 1 : turn);
          std::vector<std::uint32_t> row;
          for (std::uint32_t i = 0; i < 9 * kBendLanes && row.size() < n; ++i)
            if (i % 3 != 1 || i > 9) row.push_back(i);
          float axes[9];
          for (float& v : axes) v = float(random.uniform(-1, 1));
          const std::size_t stride = (6 + r + 7) / 8 * 8;
          Column got(n * stride, n % 5), want(n * stride, n % 5);
          const BentContacts contacts{c[0].begin(), c[1].begin(), c[2].begin(), c[3].begin(),
                                      c[4].begin(), c[5].begin(), row.data(),   row.size()};
          const auto at = pointers<6>(x.out);
          warp_rows(contacts, x.view(), at.data(), axes, stride, got.begin());
          warp_rows_ref(contacts, x.view(), at.data(), axes, stride, want.begin());
          CHECK(got.padding_untouched());
          for (std::size_t i = 0; i < row.size() * stride; ++i)
            CHECK(std::fabs(got[i] - want[i]) <= 4e-6f);
        }
  });
}

TEST_CASE("warp_rows: a row is the derivative of the warped point along the direction") {
  Random random(6);
  Warped x(1, 5, 6, 3, 0);
  const float zero[16] = {}, d[3] = {0.3f, -0.5f, 0.81f};
  const float same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  warp_points_ref(x.view(), x.q.data(), pointers<3>(x.rest).data(), nullptr, 1,
                  pointers<9>(x.out).data());
  const auto u = pointers<9>(x.out);
  for (std::uint32_t i = 0; i < kBendLanes; ++i) {
    float row[16];
    warp_rows_ref({d, d + 1, d + 2, zero, zero, zero, &i, 1}, x.view(), u.data() + 3, same, 16,
                  row);
    for (std::size_t j = 0; j < 5; ++j) {
      const auto along = [&](double by) {
        h6Vec3 way{}, turn{};
        for (std::size_t k = 0; k < 5; ++k) {
          const auto mode = [&](std::size_t axis) {
            return double(x.modes[(k * 6 + axis) * kBendLanes + i]);
          };
          const double share = double(x.q[k]) + (k == j ? by : 0);
          way = way + share * h6Vec3{mode(0), mode(1), mode(2)};
          turn = turn + share * h6Vec3{mode(3), mode(4), mode(5)};
        }
        return dot(h6Vec3{d[0], d[1], d[2]}, warped(turn, way));
      };
      constexpr double h = 1e-4;
      CHECK(double(row[6 + j]) == doctest::Approx((along(h) - along(-h)) / (2 * h)).epsilon(2e-6));
    }
  }
}

TEST_CASE("reduced_force: a linear force is the first part of the polynomial") {
  for (const std::size_t r : {1u, 8u, 21u, 64u}) {
    CAPTURE(r);
    Random random(r);
    ReducedForce p{nullptr, r, true};
    std::vector<double> P(p.padded() * r), q(r);
    for (double& c : P) c = random.uniform(-1, 1);
    for (double& v : q) v = random.uniform(-1, 1);
    p.coefficients = P.data();
    std::vector<double> want(p.padded()), K_want(r * p.padded());
    reduced_force_ref(p, q.data(), want.data(), K_want.data());
    for (std::size_t i = 0; i < p.padded(); ++i)
      for (std::size_t j = 0; j < r; ++j)
        CHECK(K_want[j * p.padded() + i] == P[(i / 8 * r + j) * 8 + i % 8]);
    on_every_target([&](const std::string&) {
      std::vector<double> f(p.padded(), 7), K(r * p.padded(), 7);
      reduced_force(p, q.data(), f.data(), K.data());
      for (std::size_t i = 0; i < f.size(); ++i) CHECK(std::fabs(f[i] - want[i]) < 1e-12);
      CHECK(K == K_want);
    });
  }
}
