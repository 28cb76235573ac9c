// SPDX-License-Identifier: Apache-2.0
// device_gate.h - keeps the haptic thread's writes to devices apart from a stop by the watchdog, a
// signal handler, another thread or the end of the process.
//
// A stop and a write can cross. So the writer marks its writes, a halt waits a little for a write,
// and a writer that was crossed stops the devices once more. The last call is always the stop.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hapsix/device.h"

namespace h6 {

class DeviceGate {
 public:
  DeviceGate() = default;
  ~DeviceGate();
  DeviceGate(const DeviceGate&) = delete;
  DeviceGate& operator=(const DeviceGate&) = delete;

  // `devices` must outlive the gate. From now on the end of the process halts them. False when
  // there are too many gates.
  bool open(const h6Device* devices, std::size_t count);

  // For the haptic thread, before its writes. False: nothing may be sent.
  bool enter();
  // After its writes. False: the devices were halted meanwhile and have been stopped once more.
  bool leave();

  // Halts for ever; waits at most 2 ms for a write. From any thread or signal handler, many times.
  void halt();
  bool halted() const { return halted_.load(); }

  // Calls the stop of all devices, or of those that live in real time.
  void stop_all() const { stop(false); }
  void stop_real() const { stop(true); }

 private:
  void stop(bool real_only) const;
  const h6Device* devices_ = nullptr;
  std::size_t count_ = 0;
  std::atomic<bool> halted_{false}, writing_{false};
};

}  // namespace h6
