// SPDX-License-Identifier: Apache-2.0
// safety.h - the last stage before a device, for every hand, always on.
//
// Whatever comes in, the output is finite and inside the rating, changes no faster than the slew
// limit (it may fall to zero faster), and carries every cause of a difference. In order, each
// frame:
//
//   watch    absent, lost, unusable, frozen, late, dead-man   -> state; trouble and its clock
//   gain     up in soft_start, down in decay_time; a jump: 0  -> SOFT_START, the trouble's cause
//   latch    not finite, lost, too fast, too long in trouble  -> zero until h6Arm
//   clamp    norms of force and torque to the rating          -> CLAMPED
//   scale    by the gain, and by the hand's speed             -> DERATED
//   slew     against the last output                          -> SLEWED
//   ceiling  gain times the rating: a slow slew must not delay a decay
//   power    given to the hand                                -> POWER
//   share    of a passivity controller, which only takes away -> PASSIVITY
//
// In the admittance modes clamp and slew act on the pose and its velocity (SPEED), the gain scales
// the allowed speed, and a latched output stays where it was last sent. METHOD.md, "The safety
// chain", has the whole table and its reasons.
#pragma once
#include <cstdint>

#include "hapsix/hapsix.h"
#include "runtime/base/math.h"
#include "runtime/hand/device_watch.h"

namespace h6 {

struct SafetyLimits {
  double force = 100, torque = 10;                // norms [N], [N m]
  double force_rate = 20000, torque_rate = 2000;  // norms [N/s], [N m/s]
  double power = 100;                             // given to the hand [W]
  double derate_speed = 2.5, cut_speed = 5;       // of the hand [m/s]
  double soft_start = 0.1, decay_time = 0.02;     // [s]
  // Admittance modes. kHandLever relates the two speeds.
  double speed = 2, angular_speed = 10;                             // norms [m/s], [rad/s]
  Vec3 workspace_min = Vec3::Zero(), workspace_max = Vec3::Zero();  // equal: no box [m]
};

// The limits from a device's ratings, never above the defaults, which are our own ceiling. A
// definition can only make them tighter.
SafetyLimits limits_of(const h6DeviceCapabilities& capabilities);
SafetyLimits limits_of(const h6DeviceCapabilities& capabilities, const h6SafetyDef& def);

// A setting of a definition that is above the device's rating. key is null where there is none.
struct AboveRating {
  const char* key = nullptr;
  const char* unit = "";
  double asked = 0, rating = 0;
};
AboveRating above_rating(const h6DeviceCapabilities& capabilities, const h6SafetyDef& def);

// A rule that may only take away from a wrench, and does so at once.
class WrenchShare {
 public:
  // The share that may go out, 0 .. 1. Called once a frame with what the chain would send.
  virtual double share(const Vec3& force, const Vec3& torque) = 0;

 protected:
  ~WrenchShare() = default;
};

class OutputGuard {
 public:
  void set_limits(const SafetyLimits& limits) { limits_ = limits; }
  const SafetyLimits& limits() const { return limits_; }

  struct Delay {
    double overdue = 0;  // how much later than a frame after the last command the next one comes [s]
    double missed = 0;   // how much longer than dt the last frame lasted, its command in time [s]
  };
  // Begins a frame. `lost`: the device could not be read or written. A command that is overdue is
  // trouble. Missed time is not, but the device felt the last command for that long, so the clocks
  // of other troubles count it.
  void note(const DeviceWatch& watch, bool lost, const Delay& delay, double dt);
  // Adds a cause of this frame, from a stage before the chain.
  void note_cause(h6Cause cause) { causes_ |= 1u << cause; }

  void fault(h6Cause cause);
  // Clears a fault and starts softly from zero; a motion starts from the device's own pose. It does
  // nothing while the device is absent, lost, frozen or sends no finite samples.
  void arm();
  void disarm();
  // Which of these calls came since the last frame, for a recording; repeat() calls them again.
  const h6SafetyInput& input() const { return input_; }
  void repeat(std::uint32_t asked);
  // For another device: not armed, and nothing has been sent. A fault stays.
  void restart();

  h6Cause fault() const { return fault_; }
  h6DeviceState state() const { return state_; }
  bool can_arm() const { return may_arm_; }
  bool armed() const { return armed_ && fault_ == H6_CAUSE_NONE; }
  // Neither force nor motion may go out in this frame.
  bool holds() const { return fault_ != H6_CAUSE_NONE || gain_ == 0; }
  double gain() const { return gain_; }
  h6HandSafety report() const;

  // The wrench that may be sent in a frame of `dt` seconds, with the causes of a difference; sets
  // status bits. `hand`: its velocity at the point that torques are about. `rule`: may be null.
  h6DeviceCommand pass(const h6Wrench& wanted, const h6Velocity& hand, double dt, h6Status* status,
                       WrenchShare* rule = nullptr);

  // The pose and velocity that may be sent in the admittance modes. Both are limited in speed; the
  // origin of the mesh frame never goes farther out of the workspace than it is. `device`: the
  // device's own pose, from which the first frame starts.
  h6DeviceCommand pass_motion(const h6Pose& device, const h6BodyState& wanted, double dt,
                              h6Status* status);

 private:
  void suffer(h6Cause cause, double seconds);
  double share_of(WrenchShare* rule, const Vec3& force, const Vec3& torque, double dt) const;
  void rise(double dt);
  void fall(double seconds);
  h6DeviceCommand finished(h6DeviceCommand command, h6Status* status);

  SafetyLimits limits_;
  bool armed_ = true;
  h6Cause fault_ = H6_CAUSE_NONE;
  h6DeviceState state_ = H6_ABSENT;
  bool may_arm_ = true;
  double gain_ = 0;
  double speed_ = 0;    // of the hand [m/s]
  double grace_ = 0;    // rest of the first frame of trouble, which changes nothing [s]
  double trouble_ = 0;  // length of the present trouble after that frame [s]
  h6Cause falling_ = H6_CAUSE_NONE;  // why the gain falls in this frame
  // The last frame sent share_ times these.
  Vec3 force_ = Vec3::Zero(), torque_ = Vec3::Zero();
  double share_ = 1;
  Vec3 x_ = Vec3::Zero();  // pose sent in the last frame, once moving_
  Quat q_ = Quat::Identity();
  bool moving_ = false;

  std::uint32_t asked_ = 0;                     // since the last frame: H6_ASKED_*, a fault's cause
  h6SafetyInput input_{};                       // of this frame
  std::uint32_t causes_ = 0, last_causes_ = 0;  // bits 1u << h6Cause
  std::uint64_t frames_[H6_CAUSE_COUNT] = {}, times_[H6_CAUSE_COUNT] = {};
};

}  // namespace h6
