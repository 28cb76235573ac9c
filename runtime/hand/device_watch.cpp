// SPDX-License-Identifier: Apache-2.0
// device_watch.cpp - freezes, jumps and speeds.
#include "runtime/hand/device_watch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace h6 {
namespace {

constexpr double kJumpAngle = 0.5;       // [rad]
constexpr double kSmoothing = 0.01;      // time constant for the velocity of the poses [s]
constexpr double kCountedFreeze = 0.05;  // freeze time of a device that counts its samples [s]
constexpr double kSlowest = 0.02;        // every device gives samples more often than that [s]

bool same_bits(const h6DeviceSample& a, const h6DeviceSample& b) {
  return std::memcmp(&a.pose, &b.pose, sizeof a.pose) == 0 &&
         std::memcmp(&a.velocity, &b.velocity, sizeof a.velocity) == 0 &&
         std::memcmp(&a.wrench, &b.wrench, sizeof a.wrench) == 0;
}

double speed_of(const Vec3& v, const Vec3& w) {
  return std::max(v.stableNorm(), kHandLever * w.stableNorm());
}

}  // namespace

void DeviceWatch::set(const h6SafetyDef& def, const h6DeviceCapabilities& device) {
  jump_ = def.pose_jump;
  simulated_ = device.frame_time;
  freeze_time_ = def.freeze_time > 0 ? def.freeze_time : device.freeze_time;
  if (!(freeze_time_ > 0)) freeze_time_ = 0;
  dead_man_ = def.dead_man_buttons;
}

// A device may rest, and its encoders with it, so the same pose alone proves nothing. Three things
// do: a sample count that stands still, a freeze time in the rating, or a velocity that would have
// changed the pose.
bool DeviceWatch::hangs(const h6DeviceSample& sample, double since) {
  const bool counts = sample.sequence != 0 || last_.sequence != 0;
  const bool same =
      seen_ && (counts ? sample.sequence == last_.sequence : same_bits(sample, last_));
  same_for_ = same ? same_for_ + since : 0;
  if (!same) return false;
  const double limit = freeze_time_ > 0 ? freeze_time_ : counts ? kCountedFreeze : 0;
  constexpr double slack = 1e-6;  // sums of frames round
  if (limit > 0 && same_for_ >= limit - slack) return true;
  if (simulated_) return false;  // a simulated device, or a program's own samples
  const double speed = speed_of(from(sample.velocity.linear), from(sample.velocity.angular));
  return same_for_ > kSlowest + slack && speed * same_for_ > jump_;
}

void DeviceWatch::see(const h6DeviceSample& sample, bool usable, double since) {
  usable_ = usable;
  jumped_ = false;
  since_ += since;
  held_ = dead_man_ == 0 || (usable && (sample.buttons & dead_man_) != 0);
  if (!usable) return;
  frozen_ = hangs(sample, since);
  if (seen_) {
    const Vec3 way = from(sample.pose.p) - from(last_.pose.p);
    const Vec3 turn = log_rotation(from(sample.pose.q).normalized() *
                                   from(last_.pose.q).normalized().conjugate());
    jumped_ = !(way.stableNorm() <= jump_ + kHandSpeed * since_) ||
              turn.norm() > kJumpAngle + kHandSpeed / kHandLever * since_;
    if (jumped_) {
      drift_.setZero();
      spin_.setZero();
    } else {
      const double share = since_ / (since_ + kSmoothing);
      drift_ += share * (way / since_ - drift_);
      spin_ += share * (turn / since_ - spin_);
    }
  }
  speed_ = std::max(speed_of(from(sample.velocity.linear), from(sample.velocity.angular)),
                    speed_of(drift_, spin_));
  last_ = sample;
  since_ = 0;
  seen_ = true;
}

}  // namespace h6
