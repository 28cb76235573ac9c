// safety.h - the last thing before a device, for every hand, always on.
//
// Whatever comes in, what goes out is finite, inside the rating, changes no faster than the slew
// limit, and carries the cause of any difference. Faults latch the output until re-armed: a wrench
// at zero, a motion where it was last sent.
#pragma once
#include "hapsix/device.h"
#include "runtime/math.h"

namespace h6 {

struct SafetyLimits {
  double force = 100, torque = 10;                // norms [N], [N m]
  double force_rate = 20000, torque_rate = 2000;  // norms [N/s], [N m/s]
  // Admittance modes. The two belong together by a lever of 0.2 m, a hand's grip and forearm.
  double speed = 2, angular_speed = 10;                             // norms [m/s], [rad/s]
  Vec3 workspace_min = Vec3::Zero(), workspace_max = Vec3::Zero();  // equal: no box [m]
};

// Limits that a device's ratings ask for: never above the defaults, which are our own ceiling.
SafetyLimits limits_of(const h6DeviceCapabilities& capabilities);

class OutputGuard {
 public:
  void set_limits(const SafetyLimits& limits) { limits_ = limits; }
  void fault(h6Cause cause) {
    if (fault_ == H6_CAUSE_NONE) fault_ = cause;
  }
  // A wrench then starts from zero, at the slew limit; a motion from the device's own pose.
  void rearm() {
    if (fault_ != H6_CAUSE_NONE) moving_ = false;
    fault_ = H6_CAUSE_NONE;
  }
  h6Cause fault() const { return fault_; }

  // The wrench that may be sent in a frame of `dt` seconds, why it differs, and status bits.
  h6DeviceCommand pass(const h6Wrench& wanted, double dt, h6Status* status);

  // The pose and velocity that may be sent, for the admittance modes. Both are limited in speed;
  // the origin of the mesh frame goes towards what is wanted but never farther out of the workspace
  // than it is. `device` is where the device says it is: the first frame starts there.
  h6DeviceCommand pass_motion(const h6Pose& device, const h6BodyState& wanted, double dt,
                              h6Status* status);

 private:
  SafetyLimits limits_;
  Vec3 force_ = Vec3::Zero(), torque_ = Vec3::Zero();  // sent in the last frame
  Vec3 x_ = Vec3::Zero();                              // pose sent in the last frame, once moving_
  Quat q_ = Quat::Identity();
  bool moving_ = false;
  h6Cause fault_ = H6_CAUSE_NONE;
};

}  // namespace h6
