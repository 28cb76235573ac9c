// SPDX-License-Identifier: Apache-2.0
// share_gate.h - whether the helper is to be asked: both ways are timed now and then.
//
// What a second thread writes, or reads, has to come over from its core's cache, and what that
// costs is the machine's affair: on virtual ones it changes while a program runs. Sums of 1,000
// contacts took 25 us alone and 17 on two threads while both cores had a cache in common, 18 and 27
// when not. Whoever runs the slices, the bits are the same, so the gate may go by the clock.
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace h6 {

class ShareGate {
 public:
  // Is work of `size` to be shared this time? It is then told how long that took.
  bool share(std::size_t size) {
    now_ = &kinds_[std::min<std::size_t>(std::bit_width(size), kKinds) - 1];
    size_ = static_cast<double>(size);
    const std::uint32_t phase = now_->times++ % kEvery;
    trial_ = phase < kTrial;
    // The first ones find in the caches what the other way left there.
    settled_ = phase % kTrial >= kTrial / 2 || phase >= 2 * kTrial;
    way_ = now_->shares != trial_;
    return way_;
  }
  void took(double ns) {
    if (!now_) return;
    Kind& kind = *now_;
    now_ = nullptr;
    if (!settled_) return;
    double& each = kind.each[way_];
    const double seen = ns / size_;
    // A stolen millisecond counts as twice the usual at most.
    each = each > 0 ? each + (trial_ ? 0.25 : 0.05) * (std::min(seen, 2 * each) - each) : seen;
    if (!(kind.each[0] > 0 && kind.each[1] > 0)) return;
    kind.shares = kind.each[1] < (kind.shares ? 1.0 : kGain) * kind.each[0];
  }

 private:
  static constexpr std::size_t kKinds = 24;     // of sizes: powers of two
  static constexpr std::uint32_t kEvery = 512;  // times until the other way is tried again
  static constexpr std::uint32_t kTrial = 8;    // so many times
  static constexpr double kGain = 0.95;         // what sharing must save before it is begun
  struct Kind {
    double each[2] = {};  // ns of one alone and shared
    std::uint32_t times = 0;
    bool shares = true;
  } kinds_[kKinds];
  Kind* now_ = nullptr;
  double size_ = 0;
  bool trial_ = false, settled_ = false, way_ = false;
};

}  // namespace h6
