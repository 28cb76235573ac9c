// SPDX-License-Identifier: Apache-2.0
// forward_arm.h - lets a device that wraps another one arm the wrapped device.
#pragma once
#include "hapsix/device.h"

namespace h6::device {

// 0 when the device needs no arming or is armed now.
inline int arm(const h6Device& device) { return device.arm ? device.arm(device.self) : 0; }

}  // namespace h6::device
