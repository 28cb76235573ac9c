// SPDX-License-Identifier: Apache-2.0
// device_gate.h - between a loop's devices, the haptic thread that writes to them and whoever stops
// them: the watchdog, a signal handler, another thread, the process's end.
//
// A stop and a write can cross. So the writer says that it writes, whoever halts waits a little for
// it, and a writer that was crossed stops the devices once more: the last word is always the
// stop's.
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

  // `devices` outlive the gate. From now on the process's end halts them. false: too many gates.
  bool open(const h6Device* devices, std::size_t count);

  // The haptic thread, around its writes; false: nothing may be sent.
  bool enter();
  // false: the devices were halted meanwhile, and have been stopped once more.
  bool leave();

  // For ever. Waits 2 ms at most for a write on its way. Any thread, a signal handler, many times.
  void halt();
  bool halted() const { return halted_.load(); }

  // The devices' own stop, of those whose time is the clock's, or of all.
  void stop_all() const { stop(false); }
  void stop_real() const { stop(true); }

 private:
  void stop(bool real_only) const;
  const h6Device* devices_ = nullptr;
  std::size_t count_ = 0;
  std::atomic<bool> halted_{false}, writing_{false};
};

}  // namespace h6
