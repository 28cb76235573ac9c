// Whatever is asked for, what reaches a device is finite, inside the rating, slow enough,
// explained.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <limits>
#include <random>

#include "runtime/safety.h"

using namespace h6;

namespace {

double norm(const h6Vec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

h6DeviceCapabilities rating(double force, double torque) {
  h6DeviceCapabilities c{};
  c.max_force = force;
  c.max_torque = torque;
  return c;
}

}  // namespace

TEST_CASE("nothing but safe commands comes out of any stream of wrenches") {
  std::mt19937_64 random(11);
  const double specials[] = {
      0, -0.0, 1e300, -1e300, 1e-310, HUGE_VAL, -HUGE_VAL, NAN, std::numeric_limits<double>::max()};
  for (int script = 0; script < 1000; ++script) {
    OutputGuard guard;
    const SafetyLimits limits = limits_of(rating(8, 0.5));
    guard.set_limits(limits);
    h6Wrench last{};
    bool faulted = false;
    for (int frame = 0; frame < 50; ++frame) {
      h6Wrench wanted;
      double* values[] = {&wanted.force.x,  &wanted.force.y,  &wanted.force.z,
                          &wanted.torque.x, &wanted.torque.y, &wanted.torque.z};
      for (double* v : values) {
        const std::uint64_t r = random();
        *v = r % 50 == 0 ? specials[(r >> 8) % 9]
                         : std::ldexp(static_cast<double>(r >> 40), -20) - 8;
      }
      h6Status status = 0;
      const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
      REQUIRE(std::isfinite(norm(out.wrench.force)));
      REQUIRE(norm(out.wrench.force) <= limits.force * (1 + 1e-12));
      REQUIRE(norm(out.wrench.torque) <= limits.torque * (1 + 1e-12));
      bool finite = true;
      for (double* v : values) finite = finite && std::isfinite(*v);
      faulted = faulted || !finite;
      if (faulted) {
        REQUIRE(out.cause == H6_CAUSE_NOT_FINITE);
        REQUIRE(norm(out.wrench.force) == 0);
        REQUIRE((status & H6_OUTPUT_FAULT) != 0);
      } else {
        const h6Vec3 df{out.wrench.force.x - last.force.x, out.wrench.force.y - last.force.y,
                        out.wrench.force.z - last.force.z};
        REQUIRE(norm(df) <= limits.force_rate * 1e-3 * (1 + 1e-9));
        const bool changed =
            out.wrench.force.x != wanted.force.x || out.wrench.torque.y != wanted.torque.y;
        REQUIRE((!changed || out.cause != H6_CAUSE_NONE));
      }
      last = out.wrench;
    }
  }
}

TEST_CASE("a wrench inside the limits passes untouched") {
  OutputGuard guard;
  h6Status status = 0;
  const h6Wrench wanted{{1, -2, 0.5}, {0.1, 0.2, 0}};
  const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
  CHECK(out.wrench.force.y == -2);
  CHECK(out.wrench.torque.x == 0.1);
  CHECK(out.cause == H6_CAUSE_NONE);
  CHECK(status == 0);
}

TEST_CASE(
    "a fault stays until it is re-armed, and the output then starts from zero at the slew limit") {
  OutputGuard guard;
  guard.set_limits(limits_of(rating(10, 1)));  // 10 N in 5 ms: 2 N a frame
  h6Status status = 0;
  const h6Wrench wanted{{10, 0, 0}, {0, 0, 0}};
  for (int i = 0; i < 10; ++i) guard.pass(wanted, 1e-3, &status);
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(10));
  guard.fault(H6_CAUSE_DEVICE_LOST);
  guard.fault(H6_CAUSE_STOPPED);  // the first cause is the one that is kept
  for (int i = 0; i < 5; ++i) {
    const h6DeviceCommand out = guard.pass(wanted, 1e-3, &status);
    CHECK(out.wrench.force.x == 0);
    CHECK(out.cause == H6_CAUSE_DEVICE_LOST);
  }
  guard.rearm();
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(2));
  CHECK(guard.pass(wanted, 1e-3, &status).wrench.force.x == h6::test::near(4));
}

TEST_CASE("no rating raises the engine's own ceiling, and a senseless one renders nothing") {
  const SafetyLimits ceiling;
  CHECK(limits_of(rating(1e9, 1e9)).force == ceiling.force);
  CHECK(limits_of(rating(1e9, 1e9)).torque_rate == ceiling.torque_rate);
  CHECK(limits_of(rating(NAN, -1)).force == 0);
  CHECK(limits_of(rating(NAN, -1)).torque == 0);
  CHECK(limits_of(rating(3, 0.2)).force == 3);
}

namespace {

double angle(const h6Quat& a, const h6Quat& b) {
  return log_rotation(from(a) * from(b).conjugate()).norm();
}
double way(const h6Vec3& a, const h6Vec3& b) { return norm({a.x - b.x, a.y - b.y, a.z - b.z}); }

h6DeviceCapabilities mover(double speed, double box) {
  h6DeviceCapabilities c{};
  c.max_velocity = speed;
  c.workspace_min = {-box, -box, -box};
  c.workspace_max = {box, box, box};
  return c;
}

const h6Pose kHome{{0.01, 0, 0}, {1, 0, 0, 0}};

}  // namespace

TEST_CASE("nothing but safe motion comes out of any stream of poses") {
  std::mt19937_64 random(12);
  const double specials[] = {
      0, -0.0, 1e300, -1e300, 1e-310, HUGE_VAL, -HUGE_VAL, NAN, std::numeric_limits<double>::max()};
  const auto number = [&](int rarity) {
    const std::uint64_t r = random();
    return r % rarity == 0 ? specials[(r >> 8) % 9]
                           : 0.25 * (std::ldexp(static_cast<double>(r >> 40), -23) - 1);
  };
  int far = 0, faults = 0;
  for (int script = 0; script < 1000; ++script) {
    OutputGuard guard;
    const SafetyLimits limits = limits_of(mover(script % 2 ? 0.5 : 0, 0.1));
    guard.set_limits(limits);
    const int rarity = script % 3 ? 100 : 1000000;
    h6Pose last = kHome;
    h6BodyState wanted{kHome, {}};
    for (int frame = 0; frame < 100; ++frame) {
      const bool jump = random() % 4 == 0;
      for (double* v : {&wanted.pose.p.x, &wanted.pose.p.y, &wanted.pose.p.z})
        *v = jump ? number(rarity) : *v + 1e-3 * number(rarity);
      Quat q = exp_rotation({number(rarity), number(rarity), (jump ? 10 : 0.01) * number(rarity)});
      if (random() % 100 == 0) q.coeffs() *= number(rarity);
      wanted.pose.q = to(q);
      wanted.velocity = {{30 * number(rarity), number(rarity), number(rarity)},
                         {100 * number(rarity), number(rarity), number(rarity)}};
      h6Status status = 0;
      const h6DeviceCommand out = guard.pass_motion(kHome, wanted, 1e-3, &status);
      REQUIRE(finite(out.pose));
      REQUIRE(from(out.pose.q).norm() == h6::test::near(1).epsilon(1e-9));
      for (double x : {out.pose.p.x, out.pose.p.y, out.pose.p.z}) REQUIRE(std::fabs(x) <= 0.1);
      REQUIRE(norm(out.velocity.linear) <= limits.speed);
      REQUIRE(norm(out.velocity.angular) <= limits.angular_speed);
      REQUIRE(way(out.pose.p, last.p) <= limits.speed * 1e-3 * (1 + 1e-9));
      REQUIRE(angle(out.pose.q, last.q) <= limits.angular_speed * 1e-3 * (1 + 1e-6));
      REQUIRE(norm(out.wrench.force) == 0);
      if (status & H6_OUTPUT_FAULT) {
        ++faults;
        REQUIRE(out.cause == H6_CAUSE_NOT_FINITE);
        REQUIRE((norm(out.velocity.linear) == 0 && norm(out.velocity.angular) == 0));
        REQUIRE((way(out.pose.p, last.p) == 0 && out.pose.q.w == last.q.w));
      } else if (out.cause == H6_CAUSE_NONE) {
        REQUIRE(way(out.pose.p, wanted.pose.p) == 0);
        REQUIRE(out.velocity.linear.x == wanted.velocity.linear.x);
        REQUIRE(angle(out.pose.q, to(from(wanted.pose.q).normalized())) < 1e-7);
      } else {
        ++far;
        REQUIRE((out.cause == H6_CAUSE_SPEED || out.cause == H6_CAUSE_CLAMPED));
        REQUIRE((status & (H6_OUTPUT_SLEWED | H6_OUTPUT_CLAMPED)) != 0);
      }
      last = out.pose;
    }
  }
  CHECK(far > 1000);
  CHECK(faults > 1000);
}

TEST_CASE("a motion inside the limits passes to the bit") {
  OutputGuard guard;
  guard.set_limits(limits_of(mover(1, 0.5)));
  h6Status status = 0;
  const h6BodyState wanted{{{0.0105, 0, 0}, {1, 0, 0, 0}}, {{0.5, 0, 0}, {0, 1, 0}}};
  const h6DeviceCommand out = guard.pass_motion(kHome, wanted, 1e-3, &status);
  CHECK(out.pose.p.x == 0.0105);
  CHECK(out.velocity.linear.x == 0.5);
  CHECK(out.velocity.angular.y == 1);
  CHECK(out.cause == H6_CAUSE_NONE);
  CHECK(status == 0);
}

TEST_CASE("motion starts where the device is, after re-arming too, and a fault freezes it") {
  OutputGuard guard;
  guard.set_limits(limits_of(mover(1, 0)));  // 1 mm a frame, no box
  h6Status status = 0;
  const h6BodyState wanted{{{1, 0, 0}, {0, 0, 0, 1}}, {{3, 0, 0}, {}}};
  h6DeviceCommand out = guard.pass_motion(kHome, wanted, 1e-3, &status);
  CHECK(out.pose.p.x == h6::test::near(0.011));
  CHECK(angle(out.pose.q, kHome.q) == h6::test::near(0.005).epsilon(1e-9));  // 1 m/s over 0.2 m
  CHECK(out.velocity.linear.x <= 1);
  CHECK(out.cause == H6_CAUSE_SPEED);
  CHECK((status & H6_OUTPUT_SLEWED) != 0);
  out = guard.pass_motion(kHome, wanted, 1e-3, &status);
  CHECK(out.pose.p.x == h6::test::near(0.012));
  guard.fault(H6_CAUSE_STOPPED);
  const h6Pose sagged{{0.005, 0, 0}, {1, 0, 0, 0}};
  for (int i = 0; i < 5; ++i) {
    out = guard.pass_motion(sagged, wanted, 1e-3, &status);
    CHECK(out.pose.p.x == h6::test::near(0.012));
    CHECK(norm(out.velocity.linear) == 0);
    CHECK(out.cause == H6_CAUSE_STOPPED);
  }
  guard.rearm();
  CHECK(guard.pass_motion(sagged, wanted, 1e-3, &status).pose.p.x == h6::test::near(0.006));
}

TEST_CASE("a workspace is never left, and a device outside is only led back") {
  OutputGuard guard;
  guard.set_limits(limits_of(mover(1, 0.05)));
  h6Status status = 0;
  const h6BodyState out_there{{{0.2, 0, 0}, {1, 0, 0, 0}}, {{1, 0.5, 0}, {}}};
  h6DeviceCommand out{};
  for (int i = 0; i < 100; ++i) out = guard.pass_motion(kHome, out_there, 1e-3, &status);
  CHECK(out.pose.p.x == 0.05);
  CHECK(out.velocity.linear.x == 0);  // not through the wall, but along it
  CHECK(out.velocity.linear.y == 0.5);
  CHECK(out.cause == H6_CAUSE_CLAMPED);
  OutputGuard lost;
  lost.set_limits(limits_of(mover(1, 0.05)));
  double x = 0.07;
  for (int i = 0; i < 30; ++i) {
    out = lost.pass_motion({{0.07, 0, 0}, {1, 0, 0, 0}}, out_there, 1e-3, &status);
    CHECK(out.pose.p.x <= x);
    CHECK(out.pose.p.x >= x - 1.0001e-3);
    x = out.pose.p.x;
  }
  CHECK(x == 0.05);
}

TEST_CASE("without any pose of the device nothing moves") {
  OutputGuard guard;
  h6Status status = 0;
  const h6Pose nowhere{{NAN, 0, 0}, {1, 0, 0, 0}};
  const h6DeviceCommand out = guard.pass_motion(nowhere, {kHome, {}}, 1e-3, &status);
  CHECK(out.cause == H6_CAUSE_NOT_FINITE);
  CHECK(finite(out.pose));
}

TEST_CASE("no device is moved faster than the engine's own ceiling") {
  const SafetyLimits ceiling;
  CHECK(limits_of(mover(100, 0)).speed == ceiling.speed);
  CHECK(limits_of(mover(0, 0)).angular_speed == ceiling.angular_speed);
  CHECK(limits_of(mover(NAN, 0)).speed == ceiling.speed);
  CHECK(limits_of(mover(0.4, 0)).angular_speed == h6::test::near(2));
}
