// SPDX-License-Identifier: Apache-2.0
// device_check.h - tests a device without a scene: reads its samples and applies 10 % of its force.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "hapsix/device.h"

namespace h6::cli {

// Samples of one device, taken at 1 kHz.
struct SampleCount {
  std::uint64_t frames = 0, failed = 0;  // reads, and reads that found the device lost
  std::uint64_t unusable = 0;            // not finite, absurdly large, or not a rotation
  std::uint64_t changed = 0;             // different from the previous sample
  double read_us_max = 0, write_us_max = 0;
};

// One push of the self check.
struct Push {
  std::string what;    // "force +x"
  double applied = 0;  // peak force [N] or torque [N m]
  double moved = 0;    // motion along the push, at its peak [m] or [rad]
};

struct CheckResult {
  SampleCount samples;
  std::vector<Push> pushes;
  std::string trouble;  // why the check ended early, or the defect found; empty if there is none
};

// Called once a frame. It returns false to end the check.
using EachFrame = std::function<bool(double time, const h6DeviceSample&, bool lost)>;

// Reads at 1 kHz and commands nothing but zero. `hangs` is called on another thread when the driver
// has not come back for kDriverSilence; nothing can end this thread then, so it ends the process.
SampleCount watch_device(const h6Device& device, double seconds, const EachFrame& each,
                         const std::function<void()>& hangs);

// Takes samples for half a second and arms the device. Then pushes for 0.4 s along and about every
// axis; each push rises smoothly to 10 % of the rating (at most 10 N or 1 N m) and falls again. A
// device that renders no force gets a constant command for a second instead. The check commands
// zero, stops the device and ends at once when the device is lost, sends an invalid pose, moves
// faster than 1 m/s or farther than 0.1 m, or when `each` returns false. Where no frame comes for
// 0.1 s it stops the device; when frames come again it arms the device and repeats the push. It
// fails where no push moves the handle. `hangs` as above.
CheckResult check_device_by_pushes(const h6Device& device, const EachFrame& each,
                                   const std::function<void()>& hangs);

}  // namespace h6::cli
