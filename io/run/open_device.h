// SPDX-License-Identifier: Apache-2.0
// open_device.h - every device that the program knows, by name: NAME[:TARGET][?KEY=VALUE&...].
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "device/hand_path.h"
#include "hapsix/result.h"

namespace h6::cli {

struct DeviceKind {
  const char* name;
  const char* form;     // how the name is typed
  const char* about;    // one line
  const char* options;  // each with its meaning; empty: none
  bool real_time;       // follows the machine's clock, not the frames'
};
const std::vector<DeviceKind>& device_kinds();

// Whether `text` names a device and its options can be read; nothing is opened.
Outcome check_device(const std::string& text);

// What a device needs to know about the scene and the body that it holds.
struct DevicePlace {
  device::HandPath path{};               // at least one row
  h6Pose home{{0, 0, 0}, {1, 0, 0, 0}};  // of the mesh frame at the start
  h6Vec3 grip{};                         // the body's centre of mass, mesh frame [m]
  double unit = 1;                       // metres in one unit of the scene
};

struct OpenedDevice {
  h6Device device{};
  std::shared_ptr<void> alive;  // owns the device
  bool real_time = false;
  std::string about;                  // what a plug-in says about itself; else empty
  std::function<std::string()> live;  // its state beside its pose, for people; may be empty
};

Result<OpenedDevice> open_device(const std::string& text, const DevicePlace& place);

}  // namespace h6::cli
