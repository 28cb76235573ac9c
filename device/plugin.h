// SPDX-License-Identifier: Apache-2.0
// plugin.h - a device from a shared library (hapsix/device_plugin.h).
//
//   probe  in a child process: load, open, read once, close. A crash or a hang ends only the child,
//          and the user gets a sentence
//   open   in this process, only after the probe succeeded
//
// No wait for a plug-in is without a limit: a hung probe is killed, and what hangs in this process
// is left to a thread that ends with it. `read` and `write` are called as they are, in the haptic
// thread; the run gives up on a thread that does not come back from them (io/run/run_scene.cpp).
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/device.h"
#include "hapsix/device_plugin.h"
#include "hapsix/result.h"

namespace h6::device {

struct PluginFile {
  std::string path;  // of the shared library; without a slash: in the working folder
  std::vector<std::pair<std::string, std::string>> options;
};

// The name of a capability that makes no sense, for an error sentence; empty if all are valid.
std::string nonsense_in(const h6PluginCapabilities& capabilities);

class PluginDevice {
 public:
  // `home` and `grip` as in h6PluginStart. A probe or an open that takes longer than `patience`
  // counts as hung [s]. Fails with a sentence when there is no such file, when it is no plug-in or
  // one for another version, when its open fails, crashes or hangs, or when its capabilities make
  // no sense.
  static Result<std::unique_ptr<PluginDevice>> open(const PluginFile& file, const h6Pose& home,
                                                    const h6Vec3& grip, double patience = 10);
  // Whether the library can be loaded and is a plug-in for this program. No device is opened.
  static Outcome loads(const std::string& path, double patience = 10);
  ~PluginDevice();
  PluginDevice(const PluginDevice&) = delete;
  PluginDevice& operator=(const PluginDevice&) = delete;

  // The interface for a loop; valid while this object lives. The plug-in's time is real time.
  h6Device device();
  const std::string& about() const { return about_; }

  // The functions behind the interface.
  int read(double time, h6DeviceSample& out);
  int write(double time, const h6DeviceCommand& command);
  int arm();

 private:
  PluginDevice() = default;
  void* library_ = nullptr;
  const h6DevicePluginV1* plugin_ = nullptr;
  void* device_ = nullptr;
  h6PluginCapabilities capabilities_{};
  std::string about_;
};

}  // namespace h6::device
