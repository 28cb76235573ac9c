// SPDX-License-Identifier: Apache-2.0
// open_device.h - opens every device that the program knows, from a text of the form
// NAME[:TARGET][?KEY=VALUE&...].
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "device/hand_path.h"
#include "hapsix/result.h"
#include "io/console/console.h"

namespace h6::cli {

struct DeviceKind {
  const char* name;
  const char* form;     // how a user types it
  const char* about;    // one line
  const char* options;  // each option with its meaning; may be empty
  bool real_time;       // the device follows the machine's clock, not the time of the frames
};
const std::vector<DeviceKind>& device_kinds();

// Checks that `text` names a device and that its options are valid. It opens nothing.
Outcome check_device(const std::string& text);
// Fails when a plug-in's file is missing or no plug-in, so that nobody waits for a bake to hear it.
// The library is loaded in a child process, and no device is opened.
Outcome check_device_file(const std::string& text);

// The scene and the held body, as far as a device needs to know them.
struct DevicePlace {
  device::HandPath path{};               // at least one row
  h6Pose home{{0, 0, 0}, {1, 0, 0, 0}};  // pose of the mesh frame at the start
  h6Vec3 grip{};                         // the body's centre of mass, mesh frame [m]
  double unit = 1;                       // metres in one unit of the scene
};

struct OpenedDevice {
  h6Device device{};
  std::shared_ptr<void> alive;  // owns the device
  bool real_time = false;
  std::string about;                  // a plug-in's description of itself; else empty
  std::function<std::string()> live;  // its current state as text for the user; may be empty
};

Result<OpenedDevice> open_device(const std::string& text, const DevicePlace& place);

constexpr double kDriverSilence = 10;  // [s] without a frame, after which a driver counts as hung

// Ends the process with kFailed and a sentence: a thread hangs in the driver of the device `names`,
// and nothing can end it.
[[noreturn]] void end_without_driver(const Console& console, const std::string& names);

}  // namespace h6::cli
