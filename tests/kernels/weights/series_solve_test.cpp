// SPDX-License-Identifier: Apache-2.0
// series_solve_test.cpp - the guarantees of the rule `series`, at any sampling of any shape.
#include "kernels/weights/series_solve.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/contact/contact_wrench.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

// Contacts in T; shapes are in metres, millimetres in size.
template <class T>
struct Patch {
  std::vector<T> column[8];  // nx ny nz rx ry rz e facing
  void add(const Vec3& r, const Vec3& n, double e, double facing = 1) {
    const double values[8] = {n[0], n[1], n[2], r[0], r[1], r[2], e, facing};
    for (int k = 0; k < 8; ++k) column[k].push_back(static_cast<T>(values[k]));
  }
  std::size_t count() const { return column[0].size(); }
  SeriesColumnsT<T> view() const {
    return {column[0].data(), column[1].data(), column[2].data(),
            column[3].data(), column[4].data(), column[5].data(),
            column[6].data(), column[7].data(), count()};
  }
  double lever() const {
    double most = 1e-3;
    for (std::size_t i = 0; i < count(); ++i)
      most = std::max(most, std::sqrt(double(column[3][i]) * column[3][i] +
                                      double(column[4][i]) * column[4][i] +
                                      double(column[5][i]) * column[5][i]));
    return most;
  }
  Vec6 axis(std::size_t i, double lever) const {
    const Vec3 n(column[0][i], column[1][i], column[2][i]);
    const Vec3 r(column[3][i], column[4][i], column[5][i]);
    Vec6 J;
    J << n, r.cross(n) / lever;
    return J;
  }
};

// Solves, and makes kappa and slack the stiffness and the load over it, as series_loads does.
template <class T>
struct Solved {
  std::vector<T> kappa, slack;
  SeriesResult result;
  Vec6 y = Vec6::Zero(), wrench = Vec6::Zero();  // wrench in k, scaled by the lever
  Mat6 net;                                      // c I - c^2 A^-1: -K in k, scaled

  Solved(const Patch<T>& patch, const SeriesParameters& p, const Vec6& start = Vec6::Zero())
      : kappa(patch.count()), slack(patch.count()), y(start) {
    result = series_solve_ref(patch.view(), p, y.data(), kappa.data(), slack.data());
    Mat6 A = p.c * Mat6::Identity();
    for (std::size_t i = 0; i < patch.count(); ++i) {
      const Vec6 J = patch.axis(i, p.lever);
      if (double(slack[i]) < p.touch) {
        kappa[i] = static_cast<T>(double(kappa[i]) * double(slack[i]) / p.touch);
        slack[i] = static_cast<T>(double(slack[i]) / 2);
      } else {
        slack[i] = static_cast<T>(double(slack[i]) - p.touch / 2);
      }
      wrench += double(kappa[i]) * double(slack[i]) * J;
      if (slack[i] > 0) A += double(kappa[i]) * J * J.transpose();
    }
    net = p.c * Mat6::Identity() - p.c * p.c * A.inverse();
  }
};

constexpr double mm = 1e-3;

Patch<double> wall(int side) {
  Patch<double> p;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      p.add({((i + 0.5) / side - 0.5) * 20 * mm, ((j + 0.5) / side - 0.5) * 20 * mm, -5 * mm},
            {0, 0, 1}, 0.3 * mm);
  return p;
}
// The lower half of a ball, 0.3 mm deep in a bowl that fits it.
Patch<double> hemisphere(int n) {
  Patch<double> p;
  for (int i = 0; i < n; ++i) {
    const double z = -(i + 0.5) / n, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
    const Vec3 out(r * std::cos(a), r * std::sin(a), z);
    p.add(10 * mm * out, -out, -0.3 * mm * z);
  }
  return p;
}
// Pressed in all around, and a little to one side.
Patch<double> cylinder(int around, int along) {
  Patch<double> p;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      const double a = 2 * M_PI * i / around;
      const Vec3 out(std::cos(a), std::sin(a), 0);
      p.add(10 * mm * out + Vec3(0, 0, ((j + 0.5) / along - 0.5) * 40 * mm), -out,
            (0.05 + 0.2 * std::cos(a)) * mm);
    }
  return p;
}
Patch<double> cone(int around, int along) {
  Patch<double> p;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      const double a = 2 * M_PI * i / around, t = (j + 0.5) / along;
      const Vec3 side(std::cos(a), std::sin(a), 0);
      p.add(8 * mm * (1 - t) * side + Vec3(0, 0, 20 * mm * t),
            -(20 * side + Vec3(0, 0, 8)).normalized(), 0.2 * mm * t);
    }
  return p;
}

std::vector<Patch<double>> shapes() {
  return {wall(3),          wall(12),         wall(100),    hemisphere(300), hemisphere(3000),
          cylinder(20, 20), cylinder(80, 50), cone(12, 10), cone(60, 50)};
}

Patch<float> random_patch(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  Patch<float> p;
  for (std::size_t i = 0; i < n; ++i) {
    double v[3];
    random.direction(v);
    const Vec3 r(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01),
                 random.uniform(-0.01, 0.01));
    p.add(r, {v[0], v[1], v[2]}, random.uniform(-0.5e-3, 0.5e-3),
          std::min(1.0, random.uniform(0, 2)));
  }
  return p;
}

// Wrench of planes that a moved body touches: e_i is exact under rigid motion where g = N at rest.
struct Planes {
  std::vector<Vec3> arm, normal, gradient;
  std::vector<double> e;
  Patch<double> moved(const Vec3& dx, const Vec3& turn) const {
    Patch<double> p;
    const double angle = turn.norm();
    const Eigen::Matrix3d R = angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                        : Eigen::Matrix3d::Identity();
    for (std::size_t i = 0; i < arm.size(); ++i) {
      const Vec3 r = R * arm[i];
      p.add(r, R * normal[i], e[i] - gradient[i].dot(dx + r - arm[i]));
    }
    return p;
  }
};

}  // namespace

TEST_CASE("series_solve: SIMD agrees with the reference on every target and count") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      const Patch<float> p = random_patch(n, 5 + n);
      SeriesParameters q{4, 0.02};
      q.touch = n % 2 ? 1e-4 : 0;
      struct {
        Vec6 y = Vec6::Zero();
        std::vector<float> kappa, slack;
      } want;
      want.kappa.resize(n), want.slack.resize(n);
      series_solve_ref(p.view(), q, want.y.data(), want.kappa.data(), want.slack.data());
      Vec6 y = Vec6::Zero();
      Column kappa(n, n % 5), slack(n, n % 3);
      const SeriesResult got = series_solve(p.view(), q, y.data(), kappa.begin(), slack.begin());
      CHECK((y - want.y).norm() <= 1e-9 * (want.y.norm() + 1e-9));
      CHECK(got.residual <= 1e-6);
      CHECK(kappa.padding_untouched());
      CHECK(slack.padding_untouched());
      for (std::size_t i = 0; i < n; ++i) {
        CHECK(kappa[i] == h6::test::near(want.kappa[i]).epsilon(1e-6));
        CHECK(std::fabs(slack[i] - want.slack[i]) <= 1e-10);
      }
    }
  });
}

TEST_CASE(
    "series_solve: thousands of contacts are solved alike from cold, however they are sorted") {
  Patch<float> ball;
  const Patch<double> exact = hemisphere(3000);
  for (std::size_t i = 0; i < exact.count(); ++i) {
    const auto& c = exact.column;
    ball.add({c[3][i], c[4][i], c[5][i]}, {c[0][i], c[1][i], c[2][i]}, c[6][i]);
  }
  // One deep contact after a thousand that are about to touch: no sample of them contains it.
  Patch<float> hidden;
  for (int i = 0; i < 1000; ++i) hidden.add({0.01, 1e-5 * i, 0}, {0, 0, 1}, -1e-4);
  hidden.add({0.005, 0, 0}, {0, 1, 0}, 4e-4);
  for (const Patch<float>& p : {ball, hidden, random_patch(900, 3), random_patch(5001, 4)}) {
    SeriesParameters q{4, 0.02};
    q.touch = p.count() % 2 ? 3e-5 : 0;
    const Solved<float> want(p, q);
    on_every_target([&](const std::string&) {
      Vec6 y = Vec6::Zero();
      std::vector<float> kappa(p.count()), slack(p.count());
      const SeriesResult got = series_solve(p.view(), q, y.data(), kappa.data(), slack.data());
      CHECK(got.residual <= 1e-6);
      CHECK(got.iterations <= want.result.iterations + 1);
      CHECK((y - want.y).norm() <= 2e-6 * want.y.norm());
    });
  }
}

TEST_CASE("series_solve: slices in any order give the same bits, from a start near or far off") {
  const Patch<float> p = random_patch(9001, 6);
  SeriesParameters q{4, 0.02};
  q.touch = 3e-5;
  const Solved<float> want(p, q);
  const SliceRunner backwards{[](void*, std::size_t slices, SliceRunner::Work work, void* context) {
    while (slices-- > 0) work(context, slices);
  }};
  Vec6 far;
  far << 4e-3, -2e-3, 3e-3, 1e-3, 5e-3, -2e-3;
  on_every_target([&](const std::string&) {
    for (const Vec6& start : {Vec6(Vec6::Zero()), Vec6(1.001 * want.y), far}) {
      Vec6 y = start, other = start;
      std::vector<float> kappa(p.count()), slack(p.count()), kappa2(p.count()), slack2(p.count());
      const SeriesResult got = series_solve(p.view(), q, y.data(), kappa.data(), slack.data());
      series_solve(p.view(), q, other.data(), kappa2.data(), slack2.data(), backwards);
      CHECK(got.residual <= 1e-6);
      CHECK((y - want.y).norm() <= 2e-6 * want.y.norm());
      CHECK(y == other);
      CHECK(kappa == kappa2);
      CHECK(slack == slack2);
    }
  });
}

TEST_CASE("series_solve: slack is told from none to the last bit of a float") {
  const SeriesParameters q{4, 0.02, 1e-6, 0};  // y stays where it starts
  Vec6 start;
  start << 3e-4, -2e-4, 5e-4, 1e-4, 4e-4, -6e-4;
  Patch<float> p = random_patch(3000, 9);
  int some = 0;
  for (std::size_t i = 0; i < p.count(); ++i) {
    const double at = p.axis(i, q.lever).dot(start);
    // Just above, just below and far below, a few in a row each.
    const double gap = i / 64 % 3 == 0 ? 1e-7 : i / 64 % 3 == 1 ? -1e-7 : -1e-2;
    p.column[6][i] = static_cast<float>(at + gap * std::fabs(at));
  }
  const Solved<float> want(p, q, start);
  for (const float slack : want.slack) some += slack > 0;
  CHECK(some > 300);
  CHECK(some < 2000);
  on_every_target([&](const std::string&) {
    Vec6 y = start;
    std::vector<float> kappa(p.count()), slack(p.count());
    series_solve(p.view(), q, y.data(), kappa.data(), slack.data());
    CHECK(y == start);
    for (std::size_t i = 0; i < p.count(); ++i)
      CHECK(std::fabs(slack[i] - want.slack[i]) <= 1e-6 * want.slack[i] + 1e-18);
  });
}

TEST_CASE("series_solve: no sampling of any shape makes the net stiffness larger than c k") {
  for (const double c : {2.5, 4.0, 10.0})
    for (const Patch<double>& shape : shapes()) {
      const Solved<double> s(shape, {c, shape.lever()});
      CAPTURE(c);
      CAPTURE(shape.count());
      CHECK(s.result.residual <= 1e-6);
      const Eigen::SelfAdjointEigenSolver<Mat6> eigen(s.net);
      CHECK(eigen.eigenvalues()[5] <= c * (1 + 1e-12));
      CHECK(eigen.eigenvalues()[0] >= -1e-9);
      CHECK(eigen.eigenvalues()[5] >= 1 - 1e-9);
      CHECK(s.wrench.norm() > 0);
    }
}

TEST_CASE("series_solve: every contact that carries load meets at least k along its own wrench") {
  for (const Patch<double>& shape : shapes()) {
    const Solved<double> s(shape, {4, shape.lever()});
    std::size_t active = 0;
    double least = 0;
    for (std::size_t i = 0; i < shape.count(); ++i) {
      if (!(s.slack[i] > 0)) continue;
      ++active;
      const Vec6 J = shape.axis(i, shape.lever());
      // The net stiffness less the contact's own is still a stiffness.
      const Eigen::SelfAdjointEigenSolver<Mat6> rest(s.net - J * J.transpose(),
                                                     Eigen::EigenvaluesOnly);
      least = std::min(least, rest.eigenvalues()[0]);
    }
    CHECK(active > 0);
    CHECK(least >= -1e-9);
  }
}

TEST_CASE("series_solve: a lone contact carries exactly k times its depth, wherever it is") {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    double n[3], r[3];
    random.direction(n);
    random.direction(r);
    const double reach = random.uniform(0, 0.02), e = random.uniform(1e-6, 1e-3);
    Patch<double> p;
    p.add(reach * Vec3(r[0], r[1], r[2]), {n[0], n[1], n[2]}, e);
    for (const double c : {2.01, 4.0, 100.0}) {
      const Solved<double> s(p, {c, 0.02, 1e-12});
      CHECK(s.kappa[0] * s.slack[0] == h6::test::near(e).epsilon(1e-9));
    }
  }
}

TEST_CASE("series_solve: with a touch a contact begins without a jump of load or of stiffness") {
  const Patch<double> flat = wall(3);
  const double touch = 0.02 * mm;
  // Another contact rises until it carries load beside those of the wall.
  const auto at = [&](double e, double width) {
    Patch<double> p = flat;
    p.add({4 * mm, 9 * mm, -5 * mm}, Vec3(0.3, 0, 1).normalized(), e);
    return Solved<double>(p, {4, flat.lever(), 1e-13, 40, width});
  };
  for (const double width : {0.0, touch}) {
    double none = -0.3 * mm, some = 0.6 * mm;  // where it carries no load, and where it does
    for (int i = 0; i < 60; ++i) {
      const double middle = (none + some) / 2;
      (at(middle, width).slack.back() > 0 ? some : none) = middle;
    }
    CHECK(some > none);
    CHECK(at(some, width).wrench.isApprox(at(none, width).wrench, 1e-6));
    const Mat6 jump = at(some + 1e-6 * touch, width).net - at(none, width).net;
    CHECK((jump.norm() > 0.1) == (width == 0));
    CHECK((jump.norm() < 1e-4) == (width > 0));
  }
  // Far above, the contact has its whole stiffness, and carries less by half the touch.
  Patch<double> lone;
  lone.add({0, 0, -5 * mm}, {0, 0, 1}, 0.2 * mm);
  const Solved<double> s(lone, {4, 5 * mm, 1e-13, 40, touch});
  CHECK(s.kappa[0] * s.slack[0] == h6::test::near(0.2 * mm - touch / 2).epsilon(1e-9));
}

TEST_CASE("series_solve: a contact about to touch carries nothing, and no contact ever pulls") {
  Patch<double> p;
  p.add({0, 0, -5 * mm}, {0, 0, 1}, -0.1 * mm);
  Vec6 y = Vec6::Constant(1e-4);  // a start that is far off
  const Solved<double> alone(p, {4, 5 * mm}, y);
  CHECK(alone.slack[0] == 0);
  CHECK(alone.y.norm() == 0);
  for (int seed = 0; seed < 50; ++seed) {
    const Patch<float> q = random_patch(200, 100 + seed);
    const Solved<float> s(q, {4, 0.02});
    for (std::size_t i = 0; i < q.count(); ++i) {
      CHECK(s.kappa[i] >= 0);
      CHECK(s.slack[i] >= 0);
    }
  }
}

TEST_CASE("series_solve: a contact that faces away carries nothing") {
  Patch<double> p;
  p.add({0, 0, -5 * mm}, {0, 0, 1}, 0.1 * mm);
  const Solved<double> without(p, {4, 5 * mm});
  p.add({0, 0, 5 * mm}, {0, 0, -1}, 2 * mm, 0);
  const Solved<double> with(p, {4, 5 * mm});
  CHECK(with.kappa[1] == 0);
  CHECK((with.wrench - without.wrench).norm() <= 1e-6 * without.wrench.norm());
}

void check_derivative(double touch) {
  Random random(11);
  Planes planes;
  for (int i = 0; i < 60; ++i) {
    double n[3];
    random.direction(n);
    planes.normal.push_back(Vec3(0.5 * n[0], 0.5 * n[1], 1 + 0.3 * n[2]).normalized());
    planes.gradient.push_back((planes.normal.back() + 0.3 * Vec3(n[1], n[2], n[0])).normalized());
    planes.arm.push_back(
        {random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01)});
    planes.e.push_back(random.uniform(-0.2e-3, 0.5e-3));
  }
  const double L = 0.02, c = 4;
  const SeriesParameters p{c, L, 1e-13, 40, touch};
  const auto wrench = [&](const Vec3& dx, const Vec3& turn) {
    Vec6 w = Solved<double>(planes.moved(dx, turn), p).wrench;
    w.tail<3>() *= L;  // of the scaled axes: now in m^2
    return w;
  };
  const Patch<double> at = planes.moved(Vec3::Zero(), Vec3::Zero());
  const Solved<double> s(at, p);
  // Here a slack above the touch has lost half of it, and one below is halved.
  const auto over = [&](double least) {
    return std::count_if(s.slack.begin(), s.slack.end(), [&](double u) { return u > least; });
  };
  CHECK(over(touch / 2) > 3);
  if (touch > 0) CHECK(over(0) > over(touch / 2) + 3);
  // A = c S^-2 + sum kappa J J^T, B = sum kappa J J_g^T, unscaled; K = -c S^-2 A^-1 B + geometry.
  Mat6 scale = Mat6::Identity(), A, B = Mat6::Zero();
  scale.bottomRightCorner<3, 3>() *= L * L;
  A = c * scale;
  for (std::size_t i = 0; i < at.count(); ++i) {
    if (!(s.slack[i] > 0)) continue;
    Vec6 J = at.axis(i, 1), Jg;
    Jg << planes.gradient[i], planes.arm[i].cross(planes.gradient[i]);
    A += s.kappa[i] * J * J.transpose();
    B += s.kappa[i] * J * Jg.transpose();
  }
  Mat6 K = -c * scale * A.inverse() * B;
  const Vec6 w0 = wrench(Vec3::Zero(), Vec3::Zero());
  const auto cross = [](const Vec3& v) {
    Eigen::Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
  };
  K.topRightCorner<3, 3>() -= cross(w0.head<3>());
  K.bottomRightCorner<3, 3>() -= cross(w0.tail<3>());
  Mat6 numeric;
  for (int i = 0; i < 6; ++i) {
    const double h = i < 3 ? 1e-8 : 1e-6;
    Vec3 step = Vec3::Zero();
    step[i % 3] = h;
    const Vec3 none = Vec3::Zero();
    numeric.col(i) = (wrench(i < 3 ? step : none, i < 3 ? none : step) -
                      wrench(i < 3 ? Vec3(-step) : none, i < 3 ? none : Vec3(-step))) /
                     (2 * h);
  }
  for (int r = 0; r < 6; r += 3)
    for (int col = 0; col < 6; col += 3) {
      const Eigen::Matrix3d a = K.block<3, 3>(r, col), n = numeric.block<3, 3>(r, col);
      CAPTURE(r);
      CAPTURE(col);
      CHECK((a - n).norm() <= 1e-8 * n.norm());
    }
}

TEST_CASE("series_solve: the net stiffness is the exact derivative of the wrench") {
  check_derivative(0);
  check_derivative(0.1 * mm);
}

TEST_CASE("series_solve: 12 steps do from cold, 3 from the last frame (4 with a touch)") {
  for (const double touch : {0.0, 0.01 * mm})
    for (const Patch<double>& shape : shapes()) {
      const SeriesParameters p{4, shape.lever(), 1e-6, 12, touch};
      Solved<double> cold(shape, p);
      CHECK(cold.result.iterations <= 12);
      CHECK(cold.result.residual <= 1e-6);
      Patch<double> later = shape;
      for (double& e : later.column[6]) e *= 1.002;
      const Solved<double> warm(later, p, cold.y);
      CHECK(warm.result.iterations <= (touch > 0 ? 4 : 3));
      CHECK(warm.result.residual <= 1e-6);
    }
}

TEST_CASE("series_solve: where steps run out the residual says so") {
  const Patch<double> shape = hemisphere(3000);
  const Solved<double> cut(shape, {4, shape.lever(), 1e-6, 0});
  CHECK(cut.result.iterations == 0);
  CHECK(cut.result.residual > 1e-3);
}

TEST_CASE("series_solve: a start that is not finite counts as none") {
  const Patch<double> shape = hemisphere(300);
  const Solved<double> good(shape, {4, shape.lever()});
  const Solved<double> bad(shape, {4, shape.lever()},
                           Vec6::Constant(std::numeric_limits<double>::quiet_NaN()));
  CHECK((good.y - bad.y).norm() <= 1e-9 * good.y.norm());
}
