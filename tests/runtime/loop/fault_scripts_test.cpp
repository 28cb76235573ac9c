// SPDX-License-Identifier: Apache-2.0
// A thousand random scripts of all that can go wrong with a device, in virtual time: in any order
// of events no frame breaks a limit, and trouble ends at zero and stays there.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/sanitized.h"
#include "tests/support/reports.h"

using namespace h6::test;

namespace {

constexpr double kFrame = 1e-3, kMostForce = 8, kMostTorque = 0.5, kForceRate = 2000;
constexpr double kTorqueRate = 100, kPower = 3, kDecay = 0.02;
constexpr std::uint32_t kDeadMan = 1;

enum Fault { kNone, kFreeze, kNaN, kJump, kUnplug, kStall, kLetGo, kRush, kSenseless, kFaults };

// The distance from `now` to the nearest point between zero and `last`: any step towards zero is
// allowed, the rest is slew.
double slewed(const h6Vec3& now, const h6Vec3& last) {
  const double l2 = dot(last, last);
  const double s = l2 > 0 ? std::clamp(dot(now, last) / l2, 0.0, 1.0) : 0;
  return norm(now - s * last);
}

// A hand that leans on the floor, moves about and meets faults.
class Script {
 public:
  Script(BoxOnFloor& scene, unsigned seed) : random_(seed), scene_(scene) {
    scene_.hand.safety.soft_start = 0.01;
    scene_.hand.safety.max_power = kPower;
    scene_.hand.safety.dead_man_buttons = kDeadMan;
    scene_.hand.coupling.max_force = 30, scene_.hand.coupling.max_torque = 2;  // well above
    scene_.open();
    h6DeviceCapabilities device{};
    device.max_force = kMostForce, device.max_torque = kMostTorque;
    device.max_force_rate = kForceRate, device.max_torque_rate = kTorqueRate;
    h6SetRating(scene_.session, 0, &device);
    sample_ = hand_at(pose(0, 0, 3 * mm));
    sample_.buttons = kDeadMan;
  }

  void run(int frames) {
    for (int i = 0; i < frames; ++i) frame(i);
  }
  std::uint64_t seen[H6_CAUSE_COUNT] = {};
  int pushing = 0, quiet = 0;  // frames with a force, and frames that suppressed a force

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  void choose() {
    if (--left_ > 0) return;
    fault_ = random_() % 3 ? kNone : static_cast<Fault>(random_() % kFaults);
    left_ = 1 + static_cast<int>(random_() % (random_() % 2 ? 8 : 60));
    if (fault_ == kJump) left_ = 1;
  }

  // The device's sample, and the calls of the session, in this frame.
  h6DeviceSample next(int i) {
    lost_ = fault_ == kUnplug;
    late_ = fault_ == kStall ? uniform(2, 40) * kFrame : kFrame;
    if (fault_ != kFreeze) {
      const h6Vec3 before = sample_.pose.p;
      const double fast = fault_ == kRush ? 6e-3 : 0.2e-3;
      sample_.pose.p.x = std::clamp(before.x + uniform(-fast, fast), -0.03, 0.03);
      sample_.pose.p.z = std::clamp(before.z + uniform(-fast, fast), -2 * mm, 6 * mm);
      for (double h6Vec3::*axis : {&h6Vec3::x, &h6Vec3::y, &h6Vec3::z})
        sample_.velocity.linear.*axis = (sample_.pose.p.*axis - before.*axis) / kFrame;
      ++sample_.sequence;
    }
    if (fault_ == kJump) sample_.pose.p.x += sample_.pose.p.x > 0 ? -0.05 : 0.05;
    sample_.buttons = fault_ == kLetGo ? 0 : kDeadMan;
    h6DeviceSample said = sample_;
    if (fault_ == kNaN) said.pose.p.y = NAN;
    if (fault_ == kSenseless) said.velocity.linear.z = (random_() % 2 ? 1 : -1) * 1e300;
    if (i % 100 == 99) h6Arm(scene_.session);
    if (random_() % 400 == 0) h6Disarm(scene_.session);
    if (random_() % 400 == 0) h6Fault(scene_.session, H6_CAUSE_STOPPED);
    return said;
  }

  void frame(int i) {
    choose();
    const h6HandSafety before = h6::test::safety_of(scene_.session, 0);
    const h6DeviceSample said = next(i);
    const bool armed_now = i % 100 == 99;
    if (lost_) h6LoseDevice(scene_.session, 0);
    h6NoteInterval(scene_.session, late_);
    h6DeviceCommand out{};
    h6Step(scene_.session, &said, &out);
    const h6HandSafety after = h6::test::safety_of(scene_.session, 0);
    limits(out, said);
    // Only arming leads back.
    if (before.fault != H6_CAUSE_NONE && !armed_now) REQUIRE(after.fault == before.fault);
    if (after.fault != H6_CAUSE_NONE) {
      REQUIRE(norm(out.wrench.force) == 0);
      REQUIRE(norm(out.wrench.torque) == 0);
      REQUIRE(out.cause == after.fault);
    }
    // The first frame of a late command does not count and the next is held; then the output is
    // zero within decay_time.
    trouble_ = after.state == H6_ACTIVE ? 0 : trouble_ + std::max(late_, kFrame);
    if (trouble_ > kDecay + 2.5 * kFrame) {
      REQUIRE(norm(out.wrench.force) == 0);
      REQUIRE(norm(out.wrench.torque) == 0);
      REQUIRE(out.causes != 0);
    }
    for (int c = 1; c < H6_CAUSE_COUNT; ++c) seen[c] += out.causes >> c & 1u;
    pushing += norm(out.wrench.force) > 0;
    quiet += norm(out.wrench.force) == 0 && h6GetFrame(scene_.session).contacts > 0;
    last_ = out.wrench;
  }

  void limits(const h6DeviceCommand& out, const h6DeviceSample& said) {
    const double rounding = 1 + 1e-9;
    REQUIRE(std::isfinite(norm(out.wrench.force)));
    REQUIRE(std::isfinite(norm(out.wrench.torque)));
    REQUIRE(norm(out.wrench.force) <= kMostForce * rounding);
    REQUIRE(norm(out.wrench.torque) <= kMostTorque * rounding);
    REQUIRE(slewed(out.wrench.force, last_.force) <= kForceRate * kFrame * rounding);
    REQUIRE(slewed(out.wrench.torque, last_.torque) <= kTorqueRate * kFrame * rounding);
    if (std::isfinite(said.pose.p.y) && !lost_ && std::fabs(said.velocity.linear.z) < 10)
      REQUIRE(dot(out.wrench.force, said.velocity.linear) <= kPower * (1 + 1e-6));
  }

  std::mt19937_64 random_;
  BoxOnFloor& scene_;  // shared: each script has a new session but the same field
  h6DeviceSample sample_{};
  h6Wrench last_{};
  Fault fault_ = kNone;
  int left_ = 40;
  bool lost_ = false;
  double late_ = kFrame, trouble_ = 0;
};

}  // namespace

TEST_CASE("in random fault scripts, a thousand of them, no frame is above clamp or slew limit") {
  std::uint64_t seen[H6_CAUSE_COUNT] = {};
  long pushing = 0, quiet = 0;
  BoxOnFloor scene;
  const unsigned scripts = repeated(1000u, 100u);  // of 200 frames
  for (unsigned seed = 1; seed <= scripts; ++seed) {
    CAPTURE(seed);
    Script script(scene, seed);
    script.run(200);
    for (int c = 1; c < H6_CAUSE_COUNT; ++c) seen[c] += script.seen[c];
    pushing += script.pushing, quiet += script.quiet;
  }
  CHECK(pushing > 20 * scripts);  // the output was not always zero
  CHECK(quiet > 20 * scripts);
  for (const h6Cause cause :
       {H6_CAUSE_CLAMPED, H6_CAUSE_SLEWED, H6_CAUSE_LATE, H6_CAUSE_DEVICE_LOST, H6_CAUSE_STOPPED,
        H6_CAUSE_POWER, H6_CAUSE_DERATED, H6_CAUSE_OVERSPEED, H6_CAUSE_SOFT_START,
        H6_CAUSE_DEAD_MAN, H6_CAUSE_DISARMED, H6_CAUSE_POSE_JUMP, H6_CAUSE_BAD_SAMPLE,
        H6_CAUSE_FROZEN}) {
    CAPTURE(h6CauseName(cause));
    CHECK(seen[cause] > 0);
  }
}
