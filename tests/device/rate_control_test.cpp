// SPDX-License-Identifier: Apache-2.0
// rate_control_test.cpp - a cap's deflection as velocity: dead zone, curve, scales, dominant axis,
// buttons, yielding.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "device/rate_control.h"
#include "hapsix/vector.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;
using h6::test::near;

namespace {

using Axes = std::array<double, 6>;
const h6Pose origin{{0, 0, 0}, {1, 0, 0, 0}};
constexpr double dt = 1e-3;

// The velocity after the low-pass has settled.
h6Velocity settled(RateFigures f, const Axes& axes, const h6Wrench& felt = {}) {
  RateControl rate(f, origin, {});
  h6DeviceSample s{};
  for (int i = 0; i < 1000; ++i) s = rate.step(axes, 0, felt, dt);
  return s.velocity;
}

}  // namespace

TEST_CASE("full deflection is full speed, along the axes that a person at a desk expects") {
  RateFigures f;
  f.speed = 0.2, f.turn_speed = 1.5;
  // The cap: x right, y towards the user, z down. The world: x right, y away, z up.
  CHECK(settled(f, {1, 0, 0, 0, 0, 0}).linear.x == near(0.2));
  CHECK(settled(f, {0, -1, 0, 0, 0, 0}).linear.y == near(0.2));
  CHECK(settled(f, {0, 0, -1, 0, 0, 0}).linear.z == near(0.2));
  CHECK(settled(f, {0, 0, 0, 0, 0, -1}).angular.z == near(1.5));
  f.y_up = true;  // x right, y up, z towards the user
  CHECK(settled(f, {0, 0, -1, 0, 0, 0}).linear.y == near(0.2));
  CHECK(settled(f, {0, 1, 0, 0, 0, 0}).linear.z == near(0.2));
}

TEST_CASE("nothing moves in the dead zone, and speed rises from zero at its edge") {
  RateFigures f;
  f.dead_zone = 0.1;
  for (const double a : {0.0, 0.05, 0.0999, -0.0999})
    CHECK(norm(settled(f, {a, a, a, a, a, a}).linear) == 0);
  CHECK(norm(settled(f, {0.101, 0, 0, 0, 0, 0}).linear) < 1e-5);
  double before = 0;
  for (double a = 0.12; a <= 1; a += 0.02) {
    const double v = settled(f, {a, 0, 0, 0, 0, 0}).linear.x;
    CHECK(v > before);
    CHECK(settled(f, {-a, 0, 0, 0, 0, 0}).linear.x == near(-v));
    before = v;
  }
}

TEST_CASE("a higher curve is finer in the middle and the same at the end") {
  RateFigures fine, straight;
  fine.curve = 3, straight.curve = 1;
  CHECK(settled(fine, {0.4, 0, 0, 0, 0, 0}).linear.x <
        0.3 * settled(straight, {0.4, 0, 0, 0, 0, 0}).linear.x);
  CHECK(settled(fine, {1, 0, 0, 0, 0, 0}).linear.x ==
        near(settled(straight, {1, 0, 0, 0, 0, 0}).linear.x));
}

TEST_CASE("each axis has its scale: off, reversed, faster") {
  RateFigures f;
  f.scale = {0, -1, 2, 1, 1, 1};
  const h6Velocity v = settled(f, {1, 1, 1, 0, 0, 0});
  CHECK(v.linear.x == 0);
  CHECK(v.linear.y == near(f.speed));
  CHECK(v.linear.z == near(-2 * f.speed));
}

TEST_CASE("with the lock only the axis that leads moves, and it changes only for a clear leader") {
  RateFigures f;
  f.dominant = true, f.smoothing = 0;
  RateControl rate(f, origin, {});
  h6DeviceSample s = rate.step({0.5, 0.4, 0, 0.3, 0, 0}, 0, {}, dt);
  CHECK(s.velocity.linear.x > 0);
  CHECK(s.velocity.linear.y == 0);
  CHECK(norm(s.velocity.angular) == 0);
  s = rate.step({0.5, 0.55, 0, 0, 0, 0}, 0, {}, dt);
  CHECK(s.velocity.linear.x > 0);  // a lead of a tenth does not change it
  s = rate.step({0.5, 0.7, 0, 0, 0, 0}, 0, {}, dt);
  CHECK(s.velocity.linear.x == 0);
  CHECK(s.velocity.linear.y < 0);
}

TEST_CASE("the pose is the integral of the velocity, and the centre of a turn does not move") {
  RateFigures f;
  const h6Vec3 grip{0.1, 0.02, -0.03};
  RateControl rate(f, origin, grip);
  h6DeviceSample before = rate.step({}, 0, {}, dt);
  CHECK(norm(before.pose.p) == near(0.0).epsilon(1e-15));
  for (int i = 0; i < 2000; ++i) {
    const h6DeviceSample now = rate.step({0, 0, 0, 0.3, -0.9, 0.5}, 0, {}, dt);
    CHECK(norm(place(now.pose, grip) - grip) < 1e-12);
    const h6Vec3 moved = (1 / dt) * (now.pose.p - before.pose.p);
    CHECK(norm(moved - now.velocity.linear) < 2e-4);  // first order in dt
    before = now;
  }
}

TEST_CASE("the clutch holds the hand where it is at once; the input then counts again") {
  RateFigures f;
  RateControl rate(f, origin, {});
  for (int i = 0; i < 500; ++i) rate.step({1, 0, 0, 0, 0, 0}, 0, {}, dt);
  const h6DeviceSample held = rate.step({1, 0, 0, 0, 0, 0}, f.clutch_buttons, {}, dt);
  CHECK(held.velocity.linear.x == 0);
  CHECK(held.buttons == f.clutch_buttons);
  h6DeviceSample s{};
  for (int i = 0; i < 500; ++i) s = rate.step({1, 0, 0, 0, 0, 1}, f.clutch_buttons, {}, dt);
  CHECK(s.pose.p.x == held.pose.p.x);
  CHECK(s.pose.q.w == held.pose.q.w);
  for (int i = 0; i < 100; ++i) s = rate.step({1, 0, 0, 0, 0, 0}, 0, {}, dt);
  CHECK(s.pose.p.x > held.pose.p.x);
}

TEST_CASE("reset brings the hand home no faster than it may move, and a push ends it") {
  RateFigures f;
  const h6Pose home{{0.01, 0.02, 0.03}, {0.6, 0, 0.8, 0}};
  RateControl rate(f, home, {0.05, 0, 0});
  for (int i = 0; i < 1000; ++i) rate.step({1, -1, 0.5, 0.2, 0.6, -1}, 0, {}, dt);
  h6DeviceSample s = rate.step({}, f.reset_buttons, {}, dt);
  int frames = 0;
  for (; frames < 5000 && norm(s.pose.p - home.p) > 1e-9; ++frames) {
    const h6Vec3 before = s.pose.p;
    s = rate.step({}, 0, {}, dt);
    CHECK(norm(s.pose.p - before) <= (f.speed + 0.05 * f.turn_speed) * dt * (1 + 1e-9));
  }
  CHECK(frames < 5000);
  CHECK(std::fabs(s.pose.q.y) == near(0.8).epsilon(1e-9));
  for (int i = 0; i < 500; ++i) rate.step({1, 0, 0, 0, 0, 0}, 0, {}, dt);
  rate.step({}, f.reset_buttons, {}, dt);
  for (int i = 0; i < 50; ++i)
    s = rate.step({1, 0, 0, 0, 0, 0}, 0, {}, dt);  // the user pushes while the hand goes home
  for (int i = 0; i < 2000; ++i) s = rate.step({}, 0, {}, dt);
  CHECK(norm(s.pose.p - home.p) > 1e-3);
}

TEST_CASE("motion against a felt wrench stops; motion away from it or along it does not") {
  RateFigures f;
  f.yield_force = 5, f.yield_torque = 0.5;
  const h6Wrench wall{{5, 0, 0}, {0, 0, 0.5}};
  CHECK(std::fabs(settled(f, {-1, 0, 0, 0, 0, 0}, wall).linear.x) < 1e-9);
  CHECK(settled(f, {1, 0, 0, 0, 0, 0}, wall).linear.x == near(f.speed));
  CHECK(settled(f, {-1, -1, 0, 0, 0, 0}, wall).linear.y == near(f.speed));
  CHECK(std::fabs(settled(f, {0, 0, 0, 0, 0, 1}, wall).angular.z) < 1e-9);
  CHECK(settled(f, {-1, 0, 0, 0, 0, 0}, {{2.5, 0, 0}, {}}).linear.x == near(-0.5 * f.speed));
  f.yield_force = 0;
  CHECK(settled(f, {-1, 0, 0, 0, 0, 0}, wall).linear.x == near(-f.speed));
}

TEST_CASE("for any input the pose stays finite, a rotation, and no faster than the figures") {
  RateFigures f;
  f.yield_force = 1, f.yield_torque = 1;
  RateControl rate(f, origin, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-3, 3);
  const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 0};
  h6DeviceSample before = rate.step({}, 0, {}, 0);
  for (int i = 0; i < 100000; ++i) {
    const auto value = [&] { return random() % 5 == 0 ? odd[random() % 6] : any(random); };
    const double step = random() % 10 == 0 ? odd[random() % 6] : dt;
    const h6DeviceSample s =
        rate.step({value(), value(), value(), value(), value(), value()},
                  static_cast<std::uint32_t>(random() % 4),
                  {{value(), value(), value()}, {value(), value(), value()}}, step);
    REQUIRE(std::fabs(dot(s.pose.q, s.pose.q) - 1) < 1e-9);
    REQUIRE(norm(s.pose.p - before.pose.p) <= std::sqrt(3.0) * f.speed * 0.1 * 1.001);
    before = s;
  }
}

TEST_CASE("figures out of range are refused by name") {
  RateFigures f;
  CHECK(check_rate_figures(f));
  f.curve = 0.5;
  CHECK(check_rate_figures(f).error().find("curve") != std::string::npos);
  f = {};
  f.scale[4] = NAN;
  CHECK(check_rate_figures(f).error().find("scale of ry") != std::string::npos);
}
