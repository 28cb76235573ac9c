// safety.h - the last thing before a device, for every hand, always on.
//
// Whatever comes in, what goes out is finite, inside the rating, changes no faster than the slew
// limit, and carries the cause of any difference. Faults latch the output at zero until re-armed.
#pragma once
#include "hapsix/device.h"
#include "runtime/math.h"

namespace h6 {

struct SafetyLimits {
  double force = 100, torque = 10;                // norms [N], [N m]
  double force_rate = 20000, torque_rate = 2000;  // norms [N/s], [N m/s]
};

// Limits that a device's ratings ask for: never above the defaults, which are our own ceiling.
SafetyLimits limits_of(const h6DeviceCapabilities& capabilities);

class OutputGuard {
 public:
  void set_limits(const SafetyLimits& limits) { limits_ = limits; }
  void fault(h6Cause cause) {
    if (fault_ == H6_CAUSE_NONE) fault_ = cause;
  }
  void rearm() { fault_ = H6_CAUSE_NONE; }  // the output then starts from zero, at the slew limit
  h6Cause fault() const { return fault_; }

  // The wrench that may be sent in a frame of `dt` seconds, why it differs, and status bits.
  h6DeviceCommand pass(const h6Wrench& wanted, double dt, h6Status* status);

 private:
  SafetyLimits limits_;
  Vec3 force_ = Vec3::Zero(), torque_ = Vec3::Zero();  // sent in the last frame
  h6Cause fault_ = H6_CAUSE_NONE;
};

}  // namespace h6
