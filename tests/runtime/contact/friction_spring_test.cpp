// SPDX-License-Identifier: Apache-2.0
// friction_spring_test.cpp - the friction spring of a pair: its derivatives, its limit, and how it
// forgets.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "runtime/contact/contact_stages.h"
#include "runtime/frame/session.h"
#include "tests/support/box_on_floor.h"

using namespace h6;
using namespace h6::test;

namespace {

// Two turned bodies with sticking contacts between them, in double, and the wrenches of their
// friction straight from METHOD.md.
struct Sticking {
  std::array<Body, 2> at;
  std::vector<Vec3> point, normal;  // in the axes of body 0, about its centre of mass
  std::vector<double> load;
  Vec6 q;  // axes of body 1
  double total = 0;
  const FrictionLaw law{1e4, 1.0};
  std::size_t planes;  // the other rows are along a line

  explicit Sticking(std::size_t planes_ = 9) : planes(planes_) {
    for (int b = 0; b < 2; ++b) {
      at[b].fixed = false;
      at[b].x = Vec3(0.003 + 0.02 * b, -0.01, 0.02 * b);
      turn(at[b], Vec3(0.7, -0.4 + b, 0.3));
    }
    for (int i = 0; i < 12; ++i) {
      const double a = 1.3 * i;
      point.push_back(Vec3(10 * std::cos(a), 9 * std::sin(a), -6 + std::sin(5 * a)) * mm);
      normal.push_back(Vec3(0.3 * std::cos(2 * a), 0.2 * std::sin(3 * a), 1).normalized());
      load.push_back((1 + 0.5 * std::sin(7 * a)) * 1e-4);
      total += load.back();
    }
    q << Vec3(0.05, -0.03, 0.02) * mm, Vec3(0.004, 0.003, -0.005);
    // The first line is stretched, the next is on its way back, and so on.
    const Vec3 d = at[1].R * q.head<3>(), theta = at[1].R * q.tail<3>();
    for (std::size_t i = planes; i < point.size(); ++i) {
      const bool back = (d + theta.cross(at[0].R * point[i])).dot(at[0].R * normal[i]) < 0;
      if (back == ((i - planes) % 2 == 0)) normal[i] = -normal[i];
    }
  }
  static void turn(Body& body, const Vec3& by) {
    body.q = exp_rotation(by) * body.q;
    body.R = body.q.toRotationMatrix();
  }
  std::array<Vec6, 2> wrenches(const std::array<Body, 2>& now) const {
    const auto relative = [](const std::array<Body, 2>& s) {
      return std::pair{Vec3(s[1].R.transpose() * (s[0].x - s[1].x)),
                       Quat(s[1].q.conjugate() * s[0].q)};
    };
    const auto [x0, q0] = relative(at);
    const auto [x1, q1] = relative(now);
    const Vec3 d = now[1].R * (q.head<3>() + x1 - x0);
    const Vec3 theta = now[1].R * (q.tail<3>() + log_rotation(q1 * q0.conjugate()));
    std::array<Vec6, 2> w{Vec6::Zero(), Vec6::Zero()};
    for (std::size_t i = 0; i < point.size(); ++i) {
      const Vec3 r = now[0].R * point[i], n = now[0].R * normal[i], rb = now[0].x + r - now[1].x;
      const Vec3 moved = d + theta.cross(r);
      const double along = n.dot(moved);
      const Vec3 z = i < planes ? Vec3(moved - n * along) : Vec3(n * std::max(along, 0.0));
      const Vec3 f = -law.stiffness * load[i] / total * z;
      w[0].head<3>() += f, w[0].tail<3>() += r.cross(f);
      w[1].head<3>() -= f, w[1].tail<3>() -= rb.cross(f);
    }
    return w;
  }
  // Column by column: how the wrench on body `on` changes with the motion of body `by`.
  Mat6 difference(int on, int by) const {
    Mat6 out;
    for (int k = 0; k < 6; ++k) {
      const double h = k < 3 ? 1e-6 : 1e-4;
      const auto f = [&](double step) {
        std::array<Body, 2> moved = at;
        if (k < 3) moved[by].x[k] += step;
        if (k >= 3) turn(moved[by], step * Vec3::Unit(k - 3));
        return wrenches(moved)[on];
      };
      out.col(k) = (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
    }
    return out;
  }
};

// Rows first..first+count-1 of columns n and r, `planes` of them in the plane.
FrictionRows<double> rows_of(const std::vector<double>* c, const double* load, std::size_t first,
                             std::size_t count, std::size_t planes, double total) {
  const auto rows = [&](std::size_t skip, std::size_t some, bool lines) {
    const auto at = [&](int k) { return c[k].data() + first + skip; };
    return kernels::FrictionRowsT<double>{at(0), at(1),       at(2), at(3), at(4),
                                          at(5), load + skip, some,  lines};
  };
  return {rows(0, planes, false), rows(planes, count - planes, true), total};
}
Mat6 stiffness_of(const FrictionRows<double>& rows, const FrictionLaw& law, const Vec6& q) {
  Mat6 K;
  friction_stiffness(rows, law, q, q, K);
  return K;
}

}  // namespace

TEST_CASE("exact derivatives of sticking friction agree with central differences") {
  Sticking scene;
  std::vector<double> columns[6];
  for (std::size_t i = 0; i < scene.point.size(); ++i) {
    const Vec3 n = scene.at[0].R * scene.normal[i], r = scene.at[0].R * scene.point[i];
    for (int k = 0; k < 3; ++k) columns[k].push_back(n[k]), columns[3 + k].push_back(r[k]);
  }
  const FrictionRows<double> rows =
      rows_of(columns, scene.load.data(), 0, scene.load.size(), scene.planes, scene.total);
  Vec6 q;
  q << scene.at[1].R * scene.q.head<3>(), scene.at[1].R * scene.q.tail<3>();
  FrictionSpring spring;
  spring.holds = true;
  spring.K = stiffness_of(rows, scene.law, q);
  spring.f = spring.elastic = -(spring.K * q);
  spring.turning = friction_turning(rows, scene.law, q, q);
  std::array<LinearWrench, 2> acting;
  for (LinearWrench& w : acting) w.set_zero();
  BetweenBodies between;
  Pair pair;
  pair.a = 0, pair.b = 1, pair.between = &between;
  Settings set;
  set.gradient = H6_EXACT;
  set.contact = h6DefaultContactDef();
  add_friction(set, sides_of(pair, scene.at, acting), pair, spring);

  const std::array<Vec6, 2> w = scene.wrenches(scene.at);
  for (int b = 0; b < 2; ++b) CHECK((acting[b].f - w[b]).norm() < 1e-12 * w[b].norm());
  const Mat6* const blocks[2][2] = {{&acting[0].K, &between.Kab}, {&between.Kba, &acting[1].K}};
  for (int on = 0; on < 2; ++on)
    for (int by = 0; by < 2; ++by) {
      CAPTURE(on);
      CAPTURE(by);
      const Mat6 right = scene.difference(on, by);
      CHECK((*blocks[on][by] - right).norm() < 1e-6 * right.norm());
      // Forces by turns, and torques, are smaller than forces by shifts.
      CHECK((blocks[on][by]->bottomRightCorner<3, 3>() - right.bottomRightCorner<3, 3>()).norm() <
            1e-6 * right.bottomRightCorner<3, 3>().norm());
    }
  // The geometric terms matter here, and D is beta times K.
  CHECK((spring.K + scene.difference(0, 0)).norm() > 1e-5 * spring.K.norm());
  CHECK((acting[0].D + set.contact.damping * spring.K).norm() < 1e-12 * acting[0].D.norm());
}

TEST_CASE("friction is at most mu times the load, in its plane, and only against its line") {
  Sticking scene;
  std::vector<double> columns[6];
  for (std::size_t i = 0; i < scene.point.size(); ++i)
    for (int k = 0; k < 3; ++k)
      columns[k].push_back(scene.normal[i][k]), columns[3 + k].push_back(scene.point[i][k]);
  // Together they are no stiffer than k, and k r^2 in rotation.
  const FrictionRows<double> all =
      rows_of(columns, scene.load.data(), 0, scene.load.size(), scene.planes, scene.total);
  double radius = 0;
  for (const Vec3& r : scene.point) radius = std::max(radius, r.norm());
  const Mat6 together = stiffness_of(all, {1e4, 1.0}, scene.q);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 to(std::sin(1.7 * i), std::cos(2.9 * i), std::sin(3.1 * i + 1));
    const Vec3 unit = to.normalized();
    CHECK(unit.dot(together.topLeftCorner<3, 3>() * unit) <= 1e4);
    CHECK(unit.dot(together.bottomRightCorner<3, 3>() * unit) <= 1e4 * radius * radius);
  }
  for (const double limit : {1e-3, 1e-4, 3e-5, 1e-6}) {
    double most = 0;  // the force of one contact alone, over what mu allows
    int free = 0;     // lines on their way back
    for (std::size_t i = 0; i < scene.point.size(); ++i) {
      const double alone[1] = {scene.load[i]};
      const bool line = i >= scene.planes;
      const FrictionRows<double> row = rows_of(columns, alone, i, 1, line ? 0 : 1, scene.total);
      const Mat6 K = stiffness_of(row, {1e4, limit}, scene.q);
      const Vec3 f = -(K * scene.q).head<3>();
      const double mu = limit / scene.total;
      most = std::max(most, f.norm() / (mu * 1e4 * scene.load[i]));
      CHECK(f.norm() <= (1 + 1e-12) * mu * 1e4 * scene.load[i]);
      const double along = f.dot(scene.normal[i]);
      if (!line) CHECK(std::fabs(along) < 1e-12 * f.norm());
      if (line) CHECK(along <= 0);
      if (line) CHECK(f.cross(scene.normal[i]).norm() <= 1e-12 * f.norm());
      free += line && f.norm() == 0;
    }
    CHECK(free > 0);
    if (limit < 5e-5) CHECK(most > 0.999);
  }
}

TEST_CASE("the spring forgets motion that no contact feels") {
  BoxOnFloor box;
  box.def.contact.friction = 0.5;
  box.open();
  box.hold(pose(0.1 * mm, 0, 4.5 * mm), 300);
  const double before = box.body().pose.p.z;
  box.hold({{0.1 * mm, 0, 2 * mm}, about(0, 1, 0, 0.01)}, 300);
  CHECK(before - box.body().pose.p.z > 0.01 * mm);
  // Contacts feel shifts along the floor and turns about its normal.
  const Vec6 q = box.session->frictions[0].q;
  CHECK(std::fabs(q[0]) > 1e-6);
  CHECK(std::fabs(q[2]) < 1e-7);
}
