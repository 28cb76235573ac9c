// SPDX-License-Identifier: Apache-2.0
// recorded_hand.h - a hand that gives the samples of an earlier run again, bit by bit, whatever is
// felt; at rest where the last one was.
#pragma once
#include <memory>
#include <vector>

#include "hapsix/device.h"
#include "hapsix/result.h"

namespace h6::device {

class RecordedHand {
 public:
  // `samples`: one a frame, `rate` a second, the first at time 0. At another rate the nearest is
  // given. A sentence when there is none, or the rate is not in 1 .. 1e6.
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
