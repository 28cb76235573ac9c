// SPDX-License-Identifier: Apache-2.0
// steering_test.cpp - a user takes a hand off its path and gives it back: no jump, bounded speed,
// and the path's time stands still meanwhile.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "device/hand_path.h"
#include "hapsix/vector.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;

namespace {

constexpr double kFrame = 1e-3;

h6Pose at(double x, double angle = 0) {
  return {{x, 0, 0}, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}};
}

// A path of 10 cm and a quarter of a turn in two seconds.
HandPath path() {
  HandPath p;
  p.time = {0, 2};
  p.pose = {at(0), at(0.1, 1.5)};
  return p;
}

bool same(const h6DeviceSample& a, const h6DeviceSample& b) {
  return a.pose.p.x == b.pose.p.x && a.pose.p.y == b.pose.p.y && a.pose.q.w == b.pose.q.w &&
         a.pose.q.z == b.pose.q.z && a.velocity.linear.x == b.velocity.linear.x;
}

}  // namespace

TEST_CASE("a hand that nobody takes follows its path to the bit") {
  HandPath steered = path();
  const HandPath plain = path();
  steered.steering = std::make_shared<Steering>();
  for (double t = 0; t < 3; t += kFrame) CHECK(same(steered.at(t), plain.at(t)));
}

TEST_CASE("a hand that is taken goes where it is wanted, at a calm speed, without a jump") {
  HandPath p = path();
  p.steering = std::make_shared<Steering>();
  h6DeviceSample last = p.at(0);
  Steering::Wish wish;
  double t = kFrame;
  for (; t < 0.5; t += kFrame) last = p.at(t);
  wish.held = true;
  p.steering->wish(wish);
  for (int i = 0; i < 100; ++i, t += kFrame) {  // no wanted pose: it comes to rest
    const h6DeviceSample now = p.at(t);
    CHECK(norm(now.pose.p - last.pose.p) < 1e-3 * Steering::kMaxSpeed + 1e-9);
    last = now;
  }
  wish.placed = true;
  wish.pose = {{1, 0.5, 0}, unit({0, 0, 1, 0})};  // far away at once
  p.steering->wish(wish);
  for (int i = 0; i < 4000; ++i, t += kFrame) {
    const h6DeviceSample now = p.at(t);
    CHECK(norm(now.pose.p - last.pose.p) <= kFrame * Steering::kMaxSpeed * 1.0001);
    CHECK(norm(turn(last.pose.q, now.pose.q)) <= kFrame * Steering::kMaxTurn * 1.0001);
    // The reported velocity is the motion.
    CHECK(norm(now.pose.p - last.pose.p - kFrame * now.velocity.linear) < 1e-9);
    last = now;
  }
  CHECK(norm(last.pose.p - wish.pose.p) < 1e-6);
  CHECK(norm(turn(last.pose.q, wish.pose.q)) < 1e-5);
}

TEST_CASE("a hand that is given back goes on where its path was left") {
  HandPath p = path();
  const HandPath plain = path();
  p.steering = std::make_shared<Steering>();
  double t = 0;
  for (; t < 0.8; t += kFrame) (void)p.at(t);
  const double left = t;
  Steering::Wish wish;
  wish.held = true;
  wish.placed = true;
  wish.pose = at(-0.05);
  p.steering->wish(wish);
  for (int i = 0; i < 1500; ++i, t += kFrame) (void)p.at(t);
  p.steering->wish({});
  // It continues the path from the time at which it left it.
  bool back = false;
  for (int i = 0; i < 5000 && !back; ++i, t += kFrame) {
    const double before = p.at(t).pose.p.x;
    back = std::fabs(before - plain.keyframe(left).pose.p.x) < 1e-9;
  }
  h6DeviceSample end{};
  for (int i = 0; i < 3000; ++i, t += kFrame) end = p.at(t);
  CHECK(end.pose.p.x == h6::test::near(0.1));
}

TEST_CASE("the clutch is a button, only while the hand is held") {
  HandPath p = path();
  p.steering = std::make_shared<Steering>();
  Steering::Wish wish;
  wish.clutched = true;
  p.steering->wish(wish);
  CHECK(p.at(0).buttons == 0);
  wish.held = true;
  p.steering->wish(wish);
  CHECK(p.at(kFrame).buttons == 1);
}
