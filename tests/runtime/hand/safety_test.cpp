// SPDX-License-Identifier: Apache-2.0
// For any request, the output to a device is finite, inside the rating, slow enough and explained.
#include <doctest/doctest.h>
#include "hapsix/vector.h"
#include "tests/support/near.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "hapsix/hapsix.h"
#include "runtime/hand/safety.h"

using namespace h6;

namespace {

h6DeviceCapabilities rating(double force, double torque) {
  h6DeviceCapabilities c{};
  c.max_force = force;
  c.max_torque = torque;
  return c;
}

constexpr double kFrame = 1e-3;
const h6Velocity kStill{};

// Only the limits: no soft start unless a test requests it.
h6SafetyDef at_once() {
  h6SafetyDef def = h6DefaultSafetyDef();
  def.soft_start = 0;
  return def;
}

// The chain of one hand, with a device that rests where the test puts it.
struct Chain {
  OutputGuard guard;
  DeviceWatch watch;
  h6DeviceSample sample{{{0.01, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0, {}};
  h6Status status = 0;

  explicit Chain(const h6DeviceCapabilities& device, const h6SafetyDef& def = at_once()) {
    guard.set_limits(limits_of(device, def));
    watch.set(def, device);
  }
  void begin(bool lost = false, double overdue = 0) {
    status = 0;
    watch.see(sample, finite(sample.pose) && !lost, kFrame);
    guard.note(watch, lost, {overdue}, kFrame);
  }
  h6DeviceCommand step(const h6Wrench& wanted, const h6Velocity& hand = kStill) {
    begin();
    return guard.pass(wanted, hand, kFrame, &status);
  }
  h6DeviceCommand move(const h6BodyState& wanted) {
    begin();
    return guard.pass_motion(sample.pose, wanted, kFrame, &status);
  }
  double force(double newtons) { return step({{newtons, 0, 0}, {}}).wrench.force.x; }
};

bool says(const h6DeviceCommand& command, h6Cause cause) {
  return (command.causes >> cause & 1u) != 0;
}

}  // namespace

TEST_CASE("nothing but safe commands comes out of any stream of wrenches") {
  std::mt19937_64 random(11);
  const double specials[] = {
      0, -0.0, 1e300, -1e300, 1e-310, HUGE_VAL, -HUGE_VAL, NAN, std::numeric_limits<double>::max()};
  for (int script = 0; script < 1000; ++script) {
    Chain chain(rating(8, 0.5));
    const SafetyLimits limits = chain.guard.limits();
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
      const h6DeviceCommand out = chain.step(wanted);
      const h6Status status = chain.status;
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
        REQUIRE(norm(out.wrench.force - last.force) <= limits.force_rate * 1e-3 * (1 + 1e-9));
        const bool changed =
            out.wrench.force.x != wanted.force.x || out.wrench.torque.y != wanted.torque.y;
        REQUIRE((!changed || out.cause != H6_CAUSE_NONE));
      }
      last = out.wrench;
    }
  }
}

TEST_CASE("a share takes away at once, gives back within the slew limit, and never adds") {
  struct Random final : WrenchShare {
    std::mt19937 random{5};
    double now = 1;
    double share(const Vec3&, const Vec3&) override {
      if (random() % 4 == 0) now = random() % 3 == 0 ? 0 : random() % 1000 * 1e-3;
      return now;
    }
  } rule;
  Chain chain(rating(8, 0.5));
  const SafetyLimits limits = chain.guard.limits();
  std::mt19937 random(6);
  h6Wrench wanted{}, last{};
  int falls = 0;
  for (int frame = 0; frame < 20000; ++frame) {
    if (random() % 10 == 0) {
      for (double* v : {&wanted.force.x, &wanted.force.y, &wanted.force.z, &wanted.torque.x})
        *v = random() % 2000 * 1e-2 - 10;
    }
    chain.begin();
    const h6Wrench out = chain.guard.pass(wanted, kStill, kFrame, &chain.status, &rule).wrench;
    REQUIRE(norm(out.force) <= limits.force * (1 + 1e-12));
    REQUIRE(norm(out.torque) <= limits.torque * (1 + 1e-12));
    // Nearer than a slew to something between zero and the last force.
    const double step = limits.force_rate * kFrame * (1 + 1e-9);
    const double along = dot(out.force, last.force) / std::max(dot(last.force, last.force), 1e-300);
    const h6Vec3 nearest = std::clamp(along, 0.0, 1.0) * last.force;
    REQUIRE(norm(out.force - nearest) <= step);
    falls += norm(out.force - last.force) > step;
    last = out;
  }
  CHECK(falls > 100);
}

TEST_CASE("a wrench inside the limits passes untouched") {
  Chain chain(rating(100, 10));
  const h6Wrench wanted{{1, -2, 0.5}, {0.1, 0.2, 0}};
  const h6DeviceCommand out = chain.step(wanted);
  CHECK(out.wrench.force.y == -2);
  CHECK(out.wrench.torque.x == 0.1);
  CHECK(out.cause == H6_CAUSE_NONE);
  CHECK(out.causes == 0);
  CHECK(chain.status == 0);
  CHECK(chain.guard.state() == H6_ACTIVE);
}

TEST_CASE(
    "a fault stays until it is re-armed, and the output then starts from zero at the slew limit") {
  Chain chain(rating(10, 1));  // 10 N in 5 ms: 2 N a frame
  for (int i = 0; i < 10; ++i) chain.force(10);
  CHECK(chain.force(10) == h6::test::near(10));
  chain.guard.fault(H6_CAUSE_DEVICE_LOST);
  chain.guard.fault(H6_CAUSE_STOPPED);  // the first cause is kept
  for (int i = 0; i < 5; ++i) {
    const h6DeviceCommand out = chain.step({{10, 0, 0}, {}});
    CHECK(out.wrench.force.x == 0);
    CHECK(out.cause == H6_CAUSE_DEVICE_LOST);
    CHECK((chain.status & H6_OUTPUT_FAULT) != 0);
    CHECK(chain.guard.state() == H6_READY);
  }
  chain.guard.arm();
  CHECK(chain.force(10) == h6::test::near(2));
  CHECK(chain.force(10) == h6::test::near(4));
}

TEST_CASE("no rating raises the engine's own ceiling, and an invalid one renders nothing") {
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
    Chain chain(mover(script % 2 ? 0.5 : 0, 0.1));
    const SafetyLimits limits = chain.guard.limits();
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
      const h6DeviceCommand out = chain.move(wanted);
      const h6Status status = chain.status;
      REQUIRE(finite(out.pose));
      REQUIRE(from(out.pose.q).norm() == h6::test::near(1).epsilon(1e-9));
      for (double x : {out.pose.p.x, out.pose.p.y, out.pose.p.z}) REQUIRE(std::fabs(x) <= 0.1);
      REQUIRE(norm(out.velocity.linear) <= limits.speed);
      REQUIRE(norm(out.velocity.angular) <= limits.angular_speed);
      REQUIRE(norm(out.pose.p - last.p) <= limits.speed * 1e-3 * (1 + 1e-9));
      REQUIRE(angle(out.pose.q, last.q) <= limits.angular_speed * 1e-3 * (1 + 1e-6));
      REQUIRE(norm(out.wrench.force) == 0);
      if (status & H6_OUTPUT_FAULT) {
        ++faults;
        REQUIRE(out.cause == H6_CAUSE_NOT_FINITE);
        REQUIRE((norm(out.velocity.linear) == 0 && norm(out.velocity.angular) == 0));
        REQUIRE((norm(out.pose.p - last.p) == 0 && out.pose.q.w == last.q.w));
      } else if (out.cause == H6_CAUSE_NONE) {
        REQUIRE(norm(out.pose.p - wanted.pose.p) == 0);
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

TEST_CASE("a motion inside the limits passes bit for bit") {
  Chain chain(mover(1, 0.5));
  const h6BodyState wanted{{{0.0105, 0, 0}, {1, 0, 0, 0}}, {{0.5, 0, 0}, {0, 1, 0}}};
  const h6DeviceCommand out = chain.move(wanted);
  CHECK(out.pose.p.x == 0.0105);
  CHECK(out.velocity.linear.x == 0.5);
  CHECK(out.velocity.angular.y == 1);
  CHECK(out.cause == H6_CAUSE_NONE);
  CHECK(chain.status == 0);
}

TEST_CASE("motion starts where the device is, after re-arming too, and a fault freezes it") {
  Chain chain(mover(1, 0));  // 1 mm a frame, no box
  const h6BodyState wanted{{{1, 0, 0}, {0, 0, 0, 1}}, {{3, 0, 0}, {}}};
  h6DeviceCommand out = chain.move(wanted);
  CHECK(out.pose.p.x == h6::test::near(0.011));
  CHECK(angle(out.pose.q, kHome.q) == h6::test::near(0.005).epsilon(1e-9));  // 1 m/s over 0.2 m
  CHECK(out.velocity.linear.x <= 1);
  CHECK(out.cause == H6_CAUSE_SPEED);
  CHECK((chain.status & H6_OUTPUT_SLEWED) != 0);
  out = chain.move(wanted);
  CHECK(out.pose.p.x == h6::test::near(0.012));
  chain.guard.fault(H6_CAUSE_STOPPED);
  chain.sample.pose.p.x = 0.005;  // the device sagged
  for (int i = 0; i < 5; ++i) {
    out = chain.move(wanted);
    CHECK(out.pose.p.x == h6::test::near(0.012));
    CHECK(norm(out.velocity.linear) == 0);
    CHECK(out.cause == H6_CAUSE_STOPPED);
  }
  chain.guard.arm();
  CHECK(chain.move(wanted).pose.p.x == h6::test::near(0.006));
}

TEST_CASE("a workspace is never left, and a device outside is only led back") {
  Chain chain(mover(1, 0.05));
  const h6BodyState out_there{{{0.2, 0, 0}, {1, 0, 0, 0}}, {{1, 0.5, 0}, {}}};
  h6DeviceCommand out{};
  for (int i = 0; i < 100; ++i) out = chain.move(out_there);
  CHECK(out.pose.p.x == 0.05);
  CHECK(out.velocity.linear.x == 0);  // not through the wall, but along it
  CHECK(out.velocity.linear.y == 0.5);
  CHECK(out.cause == H6_CAUSE_CLAMPED);
  Chain lost(mover(1, 0.05));
  lost.sample.pose.p.x = 0.07;
  double x = 0.07;
  for (int i = 0; i < 30; ++i) {
    out = lost.move(out_there);
    CHECK(out.pose.p.x <= x);
    CHECK(out.pose.p.x >= x - 1.0001e-3);
    x = out.pose.p.x;
  }
  CHECK(x == 0.05);
}

TEST_CASE("without a pose of the device nothing moves") {
  Chain chain(mover(1, 0));
  chain.sample.pose.p.x = NAN;
  const h6DeviceCommand out = chain.move({kHome, {}});
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

TEST_CASE("after arming the output rises softly, with that cause as long as it rises") {
  h6SafetyDef def = at_once();
  def.soft_start = 0.05;
  Chain chain(rating(10, 1), def);
  double last = 0;
  for (int i = 1; i <= 60; ++i) {
    const h6DeviceCommand out = chain.step({{6, 0, 0}, {}});
    REQUIRE(out.wrench.force.x <= 6 * i * kFrame / 0.05 + 1e-12);
    REQUIRE(out.wrench.force.x >= last);
    REQUIRE(says(out, H6_CAUSE_SOFT_START) == (i < 50));
    last = out.wrench.force.x;
  }
  CHECK(last == 6);
}

TEST_CASE("the force falls linearly with the hand's speed, is cut at the limit and latched") {
  h6SafetyDef def = at_once();
  def.derate_speed = 1, def.cut_speed = 2;
  Chain chain(rating(10, 1), def);
  // In steps of 1 mm/s, because no hand gets there at once.
  for (int i = 0; i < 2000; ++i) {
    chain.sample.velocity.linear.x = 1e-3 * i;
    chain.sample.pose.p.x += 1e-6 * i;
    const h6DeviceCommand out = chain.step({{5, 0, 0}, {}});
    const double most = std::min(5.0, 5 * (2 - 1e-3 * i));
    if (i > 10) {
      REQUIRE(out.wrench.force.x == h6::test::near(most).epsilon(1e-6));
      REQUIRE(says(out, H6_CAUSE_DERATED) == (most < 5));
    }
  }
  chain.sample.velocity.linear.x = 2;
  CHECK(chain.step({{5, 0, 0}, {}}).cause == H6_CAUSE_OVERSPEED);
  chain.sample.velocity.linear.x = 0;
  CHECK(chain.force(5) == 0);
  CHECK(chain.guard.fault() == H6_CAUSE_OVERSPEED);
}

TEST_CASE("a device without velocity whose poses move is as fast as its poses") {
  Chain chain(rating(10, 1));
  for (int i = 0; i < 100 && chain.guard.fault() == H6_CAUSE_NONE; ++i) {
    chain.sample.pose.p.x += 6e-3;  // 6 m/s
    chain.force(5);
  }
  CHECK(chain.guard.fault() == H6_CAUSE_OVERSPEED);
}

TEST_CASE("a hand gets no more than its allowed power, and may give any") {
  h6SafetyDef def = at_once();
  def.max_power = 2;
  Chain chain(rating(10, 1), def);
  const h6Velocity away{{1, 0, 0}, {0, 0, 3}}, against{{-1, 0, 0}, {0, 0, -3}};
  const h6Wrench wanted{{4, 1, 0}, {0, 0, 0.5}};
  for (int i = 0; i < 20; ++i) chain.step(wanted);
  h6DeviceCommand out = chain.step(wanted, away);  // asks for 5.5 W
  CHECK(out.wrench.force.x * 1 + out.wrench.torque.z * 3 == h6::test::near(2));
  CHECK(out.wrench.force.y / out.wrench.force.x == h6::test::near(0.25));
  CHECK(says(out, H6_CAUSE_POWER));
  for (int i = 0; i < 20; ++i) out = chain.step(wanted, against);
  CHECK(out.wrench.force.x == 4);
  CHECK(out.causes == 0);
}

TEST_CASE("a definition only tightens limits, and a value above the rating is reported") {
  h6SafetyDef def = h6DefaultSafetyDef();
  CHECK(above_rating(rating(10, 1), def).key == nullptr);
  def.max_force = 11;
  CHECK(limits_of(rating(10, 1), def).force == 10);
  CHECK(std::string(above_rating(rating(10, 1), def).key) == "max_force");
  CHECK(above_rating(rating(10, 1), def).rating == 10);
  def.max_force = 4, def.max_power = 1, def.cut_speed = 1, def.max_force_rate = 50;
  const SafetyLimits limits = limits_of(rating(10, 1), def);
  CHECK(above_rating(rating(10, 1), def).key == nullptr);
  CHECK(limits.force == 4);
  CHECK(limits.power == 1);
  CHECK(limits.cut_speed == 1);
  CHECK(limits.derate_speed == 0.5);
  CHECK(limits.force_rate == 50);
}

TEST_CASE("every cause is counted: its frames, and how often it came up") {
  Chain chain(rating(10, 1));
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 20; ++i) chain.force(50);
    for (int i = 0; i < 20; ++i) chain.force(1);
  }
  const h6HandSafety report = chain.guard.report();
  CHECK(report.times[H6_CAUSE_CLAMPED] == 3);
  CHECK(report.frames[H6_CAUSE_CLAMPED] == 60);
  CHECK(report.times[H6_CAUSE_DEVICE_LOST] == 0);
  CHECK(report.state == H6_ACTIVE);
  CHECK(report.fault == H6_CAUSE_NONE);
}
