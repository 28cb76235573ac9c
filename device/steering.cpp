// SPDX-License-Identifier: Apache-2.0
#include "device/steering.h"

#include <algorithm>

#include "device/hand_path.h"
#include "hapsix/vector.h"

namespace h6::device {
namespace {

constexpr double kFrequency = 38;  // natural, critically damped [rad/s]
// The hand is back on its path when it is nearer than this [m], [rad].
constexpr double kNear = 1e-6, kNearAngle = 1e-5;

}  // namespace

// Implicit, so that any length of frame is stable.
void Steering::follow(const h6DeviceSample& goal, double h) {
  const double k = kFrequency * kFrequency, b = 2 * kFrequency, m = 1 + h * b + h * h * k;
  const auto step = [&](const h6Vec3& v, const h6Vec3& away, const h6Vec3& vw) {
    return v + (h / m) * (k * away + b * (vw - v) - (h * k) * (v - vw));
  };
  h6Velocity& v = hand_.velocity;
  v.linear = at_most(step(v.linear, goal.pose.p - hand_.pose.p, goal.velocity.linear), kMaxSpeed);
  v.angular =
      at_most(step(v.angular, turn(hand_.pose.q, goal.pose.q), goal.velocity.angular), kMaxTurn);
  hand_.pose.p = hand_.pose.p + h * v.linear;
  hand_.pose.q = turned(hand_.pose.q, h * v.angular);
}

h6DeviceSample Steering::at(const HandPath& path, double time) {
  const double h = std::clamp(time - time_, 0.0, 0.1);
  time_ = time;
  const bool was_held = wish_.held;
  wishes_.take(wish_);
  if (!off_path_) {
    hand_ = path.keyframe(time - away_);
    if (!wish_.held) return hand_;
    off_path_ = true;
    left_at_ = time - away_;
  }
  h6DeviceSample goal = path.keyframe(left_at_);
  goal.velocity = {};  // the path's time stands still
  if (wish_.held) {
    if (!wish_.placed) wish_.pose = was_held ? goal_ : hand_.pose;
    goal.pose = goal_ = wish_.pose;
  }
  follow(goal, h);
  hand_.buttons = wish_.held && wish_.clutched ? 1 : 0;
  if (!wish_.held && norm(goal.pose.p - hand_.pose.p) < kNear &&
      norm(turn(hand_.pose.q, goal.pose.q)) < kNearAngle) {
    off_path_ = false;
    away_ = time - left_at_;
  }
  return hand_;
}

}  // namespace h6::device
