// SPDX-License-Identifier: Apache-2.0
// device_gate.cpp - the order of marks and stops.
#include "runtime/loop/device_gate.h"

#include "sched/clock.h"
#include "sched/halt_list.h"

namespace h6 {

bool DeviceGate::open(const h6Device* devices, std::size_t count) {
  devices_ = devices;
  count_ = count;
  return sched::add_to_halt_list([](void* self) { static_cast<DeviceGate*>(self)->halt(); }, this);
}

DeviceGate::~DeviceGate() { sched::remove_from_halt_list(this); }

void DeviceGate::stop(bool real_only) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (devices_[i].stop && !(real_only && devices_[i].capabilities.frame_time))
      devices_[i].stop(devices_[i].self);
}

bool DeviceGate::enter() {
  writing_.store(true);
  if (!halted_.load()) return true;
  writing_.store(false);
  return false;
}

bool DeviceGate::leave() {
  const bool crossed = halted_.load();
  if (crossed) stop_all();
  writing_.store(false);
  return !crossed;
}

void DeviceGate::halt() {
  halted_.store(true);
  const std::int64_t give_up = sched::now_ns() + 2000000;
  while (writing_.load() && sched::now_ns() < give_up) {
  }
  stop_all();
}

}  // namespace h6
