// SPDX-License-Identifier: Apache-2.0
// recorded_hand.h - a hand that repeats the samples of an earlier run bit for bit, regardless of
// the force it feels; after the last sample it rests there.
#pragma once
#include <memory>
#include <vector>

#include "hapsix/device.h"
#include "hapsix/result.h"

namespace h6::device {

class RecordedHand {
 public:
  // `samples`: one per frame, `rate` per second, the first at time 0. Read at another rate it gives
  // the nearest sample. Fails with a sentence when there are none, or the rate is not in 1 .. 1e6.
  static Result<std::unique_ptr<RecordedHand>> open(std::vector<h6DeviceSample> samples,
                                                    double rate);
  h6Device device();
  double duration() const { return static_cast<double>(samples_.size()) / rate_; }  // [s]

 private:
  RecordedHand(std::vector<h6DeviceSample> samples, double rate)
      : samples_(std::move(samples)), rate_(rate) {}
  std::vector<h6DeviceSample> samples_;
  double rate_;
};

}  // namespace h6::device
