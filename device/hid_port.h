// SPDX-License-Identifier: Apache-2.0
// hid_port.h - the part of HID that a SpaceMouse needs, implemented by hidapi or by a test.
//
// Not for the haptic thread: these calls enter the kernel and may wait.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::device {

struct HidInterface {
  std::string path, serial, product;
  std::uint16_t vendor_id = 0, product_id = 0;
  std::uint16_t usage_page = 0, usage = 0;  // of the first collection; 0, 0: not known
  std::vector<std::uint8_t> descriptor;     // empty: could not be read
};

class HidHandle {
 public:
  virtual ~HidHandle() = default;
  // Reads one report, its id first. Returns its length in bytes; 0 when none came in time; -1 when
  // the device is gone.
  virtual int read(std::span<std::uint8_t> report, int timeout_ms) = 0;
  virtual bool write(std::span<const std::uint8_t> report) = 0;
};

class HidPort {
 public:
  virtual ~HidPort() = default;
  virtual std::vector<HidInterface> list() = 0;
  // Fails with a sentence; when permission is missing, it says what to install.
  virtual Result<std::unique_ptr<HidHandle>> open(const std::string& path) = 0;
};

// The system's devices; without hidapi in the build it lists none.
HidPort& system_hid();
bool built_with_hidapi();

// The text of device/udev/70-hapsix.rules, which lets the person at the machine open these devices.
const char* udev_rules();

}  // namespace h6::device
