// SPDX-License-Identifier: Apache-2.0
#include "device/recorded_hand.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "device/path_device.h"

namespace h6::device {

Result<std::unique_ptr<RecordedHand>> RecordedHand::open(std::vector<h6DeviceSample> samples,
                                                         double rate) {
  if (samples.empty()) return Failure{"a recorded hand needs at least one frame"};
  if (!(rate >= 1 && rate <= 1e6)) return Failure{"a recorded hand needs a rate of 1 to 1e6 Hz"};
  return std::unique_ptr<RecordedHand>(new RecordedHand(std::move(samples), rate));
}

h6Device RecordedHand::device() {
  // The same ratings as a path.
  const auto path = PathDevice::open({{0}, {{{0, 0, 0}, {1, 0, 0, 0}}}});
  h6Device d{};
  d.capabilities = (*path)->device().capabilities;
  std::snprintf(d.capabilities.name, sizeof d.capabilities.name, "replay");
  d.self = this;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    const auto& hand = *static_cast<const RecordedHand*>(self);
    const double last = static_cast<double>(hand.samples_.size() - 1);
    const double frame = std::nearbyint(time * hand.rate_);
    *out = hand.samples_[static_cast<std::size_t>(std::clamp(frame, 0.0, last))];
    if (frame > last) out->velocity = {};
    return 0;
  };
  d.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  d.stop = [](void*) {};  // nothing moves
  return d;
}

}  // namespace h6::device
