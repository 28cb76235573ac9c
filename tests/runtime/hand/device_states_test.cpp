// SPDX-License-Identifier: Apache-2.0
// How samples, lateness and buttons change a hand's output: states, trouble, decay, latching.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "hapsix/hapsix.h"
#include "runtime/hand/safety.h"

using namespace h6;

namespace {

constexpr double kFrame = 1e-3, kForce = 5;

// A chain that gives its full 5 N, from frame 0 on.
struct Chain {
  OutputGuard guard;
  DeviceWatch watch;
  h6DeviceSample sample{{{0.01, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0, {}};
  h6DeviceCommand command{};

  explicit Chain(std::uint32_t dead_man = 0, double freeze_time = 0) {
    h6SafetyDef def = h6DefaultSafetyDef();
    def.soft_start = 0.01;
    def.dead_man_buttons = dead_man;
    def.freeze_time = freeze_time;
    h6DeviceCapabilities device{};
    device.max_force = 10, device.max_torque = 1;
    guard.set_limits(limits_of(device, def));
    watch.set(def, device);
    sample.buttons = dead_man;
    for (int i = 0; i < 20; ++i) step();
    REQUIRE(force() == kForce);
    REQUIRE(state() == H6_ACTIVE);
  }
  double step(bool lost = false, double overdue = 0, double missed = 0) {
    h6Status status = 0;
    watch.see(sample, finite(sample.pose) && !lost, kFrame + overdue + missed);
    guard.note(watch, lost, {overdue, missed}, kFrame);
    command = guard.pass({{kForce, 0, 0}, {}}, {}, kFrame, &status);
    return force();
  }
  double force() const { return command.wrench.force.x; }
  h6DeviceState state() const { return guard.state(); }
  bool says(h6Cause cause) const { return (command.causes >> cause & 1u) != 0; }
  // Steps while the trouble lasts: the output is held one frame, zero within 20 ms, then latched.
  void decays(
      h6Cause cause, const std::function<void()>& each = [] {}) {
    double last = force();
    int to_zero = -1;
    for (int i = 0; i < 30; ++i) {
      each();
      step();
      REQUIRE(force() <= last);
      REQUIRE(says(cause));
      if (i == 0) CHECK(force() == kForce);
      if (i == 1) CHECK(force() < kForce);
      if (force() == 0 && to_zero < 0) to_zero = i;
      last = force();
    }
    CHECK(to_zero >= 2);
    CHECK(to_zero <= 20);
    CHECK(guard.fault() == cause);
    CHECK(command.cause == cause);
  }
};

}  // namespace

TEST_CASE(
    "samples that are no numbers: held a frame, zero within 20 ms, latched, never by itself") {
  Chain chain;
  const double x = chain.sample.pose.p.x;
  chain.sample.pose.p.x = NAN;
  chain.decays(H6_CAUSE_BAD_SAMPLE);
  CHECK(chain.state() == H6_DEGRADED);
  chain.guard.arm();  // not while it goes on
  CHECK(chain.step() == 0);
  chain.sample.pose.p.x = x;
  for (int i = 0; i < 50; ++i) CHECK(chain.step() == 0);
  CHECK(chain.state() == H6_READY);
  chain.guard.arm();
  chain.step();
  CHECK(chain.state() == H6_ACTIVE);
  CHECK(chain.force() > 0);
  CHECK(chain.force() < kForce);  // softly
}

TEST_CASE("a few bad samples are survived, and the force comes back softly") {
  Chain chain;
  const double x = chain.sample.pose.p.x;
  chain.sample.pose.p.x = NAN;
  for (int i = 0; i < 6; ++i) chain.step();
  CHECK(chain.state() == H6_DEGRADED);
  const double low = chain.force();
  CHECK(low < kForce);
  CHECK(low > 0);
  chain.sample.pose.p.x = x;
  chain.step();
  CHECK(chain.state() == H6_ACTIVE);
  CHECK(chain.says(H6_CAUSE_SOFT_START));
  for (int i = 0; i < 20; ++i) chain.step();
  CHECK(chain.force() == kForce);
}

TEST_CASE(
    "a sample count that stands still means a frozen device; equal poses alone mean a hand at "
    "rest") {
  Chain chain;
  for (int i = 0; i < 500; ++i) CHECK(chain.step() == kForce);
  for (int i = 0; i < 100; ++i) {
    ++chain.sample.sequence;
    CHECK(chain.step() == kForce);
  }
  for (int i = 0; i < 49; ++i) CHECK(chain.step() == kForce);
  chain.decays(H6_CAUSE_FROZEN);
  CHECK(chain.state() == H6_DEGRADED);
  chain.guard.arm();  // not while it goes on
  ++chain.sample.sequence;
  CHECK(chain.step() == 0);
  CHECK(chain.state() == H6_READY);
}

TEST_CASE("a device with a freeze time is frozen when its samples repeat for that long") {
  Chain chain(0, 0.1);
  for (int i = 0; i < 300; ++i) {
    chain.sample.pose.p.x += 1e-9;
    REQUIRE(chain.step() == kForce);
  }
  for (int i = 0; i < 99; ++i) REQUIRE(chain.step() == kForce);
  chain.decays(H6_CAUSE_FROZEN);
}

TEST_CASE("frames that last three times as long: no trouble, and the clocks of troubles run on") {
  const double missed = 2 * kFrame;
  Chain chain(0, 0.05);
  for (int i = 0; i < 300; ++i) {
    chain.sample.pose.p.x += 1e-9;
    REQUIRE(chain.step(false, 0, missed) == kForce);
  }
  CHECK(chain.command.causes == 0);
  // 50 ms of equal samples, a frame on hold and 20 ms of decay.
  int frames = 0;
  while (chain.step(false, 0, missed) > 0) ++frames;
  CHECK(frames >= 16);
  CHECK(frames <= 24);
  CHECK(chain.says(H6_CAUSE_FROZEN));
}

TEST_CASE("a pose that stands still with a velocity is frozen") {
  Chain chain;
  chain.sample.velocity.linear.x = 0.5;
  int frames = 0;
  while (chain.step() == kForce && frames < 1000) ++frames;
  CHECK(frames >= 20);
  CHECK(frames <= 45);  // 20 mm at 0.5 m/s
  CHECK(chain.says(H6_CAUSE_FROZEN));
}

TEST_CASE("a pose that jumps by 50 mm or half a turn gives zero at once and then a soft start") {
  for (const bool turns : {false, true}) {
    Chain chain;
    if (turns)
      chain.sample.pose.q = {0, 0, 1, 0};
    else
      chain.sample.pose.p.y += 0.05;
    CHECK(chain.step() == 0);
    CHECK(chain.command.cause == H6_CAUSE_POSE_JUMP);
    CHECK(chain.step() > 0);
    CHECK(chain.step() < kForce);
    CHECK(chain.says(H6_CAUSE_SOFT_START));
    for (int i = 0; i < 20; ++i) chain.step();
    CHECK(chain.force() == kForce);
    CHECK(chain.guard.fault() == H6_CAUSE_NONE);
  }
}

TEST_CASE("a fast hand is no jump") {
  Chain chain;
  for (int i = 0; i < 50; ++i) {
    chain.sample.pose.p.x += 2e-3;
    chain.sample.velocity.linear.x = 2;
    chain.step();
    REQUIRE(!chain.says(H6_CAUSE_POSE_JUMP));
  }
}

TEST_CASE("without the dead-man button the force decays in 20 ms, and comes back softly with it") {
  Chain chain(0b100);
  chain.sample.buttons = 0b011;
  double last = kForce;
  for (int i = 0; i < 20; ++i) {
    chain.step();
    CHECK(chain.force() < last);
    last = chain.force();
    CHECK(chain.command.cause == H6_CAUSE_DEAD_MAN);
  }
  CHECK(last == 0);
  CHECK(chain.state() == H6_ARMED);
  CHECK(chain.guard.fault() == H6_CAUSE_NONE);
  chain.sample.buttons = 0b110;
  CHECK(chain.step() > 0);
  CHECK(chain.force() < kForce);
  CHECK(chain.state() == H6_ACTIVE);
}

TEST_CASE("disarmed: the force decays in 20 ms and stays at zero") {
  Chain chain;
  chain.guard.disarm();
  for (int i = 0; i < 20; ++i) chain.step();
  CHECK(chain.force() == 0);
  CHECK(chain.command.cause == H6_CAUSE_DISARMED);
  CHECK(chain.state() == H6_READY);
  chain.guard.arm();
  CHECK(chain.step() > 0);
}

TEST_CASE("a lost device is at zero at once, and ready again, not armed, when it is back") {
  Chain chain;
  CHECK(chain.step(true) == 0);
  CHECK(chain.state() == H6_LOST);
  CHECK(chain.command.cause == H6_CAUSE_DEVICE_LOST);
  chain.guard.arm();
  CHECK(chain.step(true) == 0);
  CHECK(chain.state() == H6_LOST);
  for (int i = 0; i < 100; ++i) CHECK(chain.step() == 0);
  CHECK(chain.state() == H6_READY);
  chain.guard.arm();
  CHECK(chain.step() > 0);
  CHECK(chain.state() == H6_ACTIVE);
}

TEST_CASE(
    "a command that comes 5 ms late has decayed a little; 30 ms late, it is zero and latched") {
  Chain chain;
  const double late = chain.step(false, 0.004);
  CHECK(late < kForce);
  CHECK(late > 0.5 * kForce);
  CHECK(chain.says(H6_CAUSE_LATE));
  CHECK(chain.state() == H6_DEGRADED);
  for (int i = 0; i < 20; ++i) chain.step();
  CHECK(chain.force() == kForce);
  CHECK(chain.step(false, 0.03) == 0);
  CHECK(chain.command.cause == H6_CAUSE_LATE);
  for (int i = 0; i < 50; ++i) CHECK(chain.step() == 0);
  CHECK(chain.guard.fault() == H6_CAUSE_LATE);
}

TEST_CASE("before the first sample a device is absent, and the first sample finds it not armed") {
  OutputGuard guard;
  DeviceWatch watch;
  h6SafetyDef def = h6DefaultSafetyDef();
  watch.set(def, {});
  h6DeviceSample sample{{{NAN, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0, {}};
  h6Status status = 0;
  for (int i = 0; i < 100; ++i) {
    if (i == 50) sample.pose.p.x = 0;
    watch.see(sample, finite(sample.pose), kFrame);
    guard.note(watch, false, {}, kFrame);
    CHECK(guard.state() == (i < 50 ? H6_ABSENT : H6_READY));
    CHECK(guard.pass({{1, 0, 0}, {}}, {}, kFrame, &status).wrench.force.x == 0);
  }
}

TEST_CASE("every state and cause has a name of its own") {
  std::string seen;
  for (int i = 0; i < H6_DEVICE_STATE_COUNT; ++i) {
    const std::string name =
        std::string("|") + h6DeviceStateName(static_cast<h6DeviceState>(i)) + "|";
    CHECK(seen.find(name) == std::string::npos);
    seen += name;
  }
  for (int i = 0; i < H6_CAUSE_COUNT; ++i) {
    const std::string name = std::string("|") + h6CauseName(static_cast<h6Cause>(i)) + "|";
    CHECK(seen.find(name) == std::string::npos);
    seen += name;
  }
  CHECK(h6DeviceStateName(H6_DEVICE_STATE_COUNT) == nullptr);
  CHECK(h6CauseName(H6_CAUSE_COUNT) == nullptr);
}
