// SPDX-License-Identifier: Apache-2.0
// path_device.h - a hand that follows its path regardless of the force it feels, like an infinitely
// strong person.
#pragma once
#include <memory>

#include "device/hand_path.h"
#include "hapsix/result.h"

namespace h6::device {

class PathDevice {
 public:
  static Result<std::unique_ptr<PathDevice>> open(HandPath path);
  // The interface for a loop; valid while this object lives.
  h6Device device();
  const h6DeviceCommand& last() const { return last_; }

 private:
  explicit PathDevice(HandPath path) : path_(std::move(path)) {}
  HandPath path_;
  h6DeviceCommand last_{};
};

// Fails with a sentence when rows are missing, out of order, not finite or not rotations.
Outcome check_path(const HandPath& path);

}  // namespace h6::device
