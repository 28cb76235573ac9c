// arm_member.h - `arm` of h6Device (lets commands through again after a stop), in a contract that
// has it and in one that has not.
#pragma once
#include "hapsix/device.h"

namespace h6::device {

// `call`: int (*)(void* self).
template <class Device>
void set_arm(Device& device, int (*call)(void*)) {
  if constexpr (requires { device.arm; }) device.arm = call;
}

// Of a device that another stands before. 0: it needs none, or it did.
template <class Device>
int arm_behind(const Device& device) {
  if constexpr (requires { device.arm; })
    return device.arm ? device.arm(device.self) : 0;
  else
    return 0;
}

}  // namespace h6::device
