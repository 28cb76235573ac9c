// SPDX-License-Identifier: Apache-2.0
// forward_arm.h - of a device that stands before another: it arms what is behind it.
#pragma once
#include "hapsix/device.h"

namespace h6::device {

// 0: it needs no arming, or it is armed now.
inline int arm(const h6Device& device) { return device.arm ? device.arm(device.self) : 0; }

}  // namespace h6::device
