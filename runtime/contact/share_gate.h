// SPDX-License-Identifier: Apache-2.0
// share_gate.h - decides by timing whether helpers help: the one policy for all work of a frame.
//
// Data that another thread writes must be moved from its core's cache. The cost depends on the
// machine, and on a virtual machine it changes while a program runs: summing 1,000 contacts took
// 25 us on one thread and 17 on two while both cores shared a cache, and 18 and 27 while they did
// not. The results have the same bits on any thread, so the gate may decide by the clock. Every
// kind of work has a gate of its own, and a gate judges each size of work for itself.
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace h6 {

class ShareGate {
 public:
  // Decides whether to share work of `size` items this time. The caller must then report its time
  // to took().
  bool share(std::size_t size) {
    now_ =
        &kinds_[std::min<std::size_t>(std::bit_width(std::max<std::size_t>(size, 1)), kKinds) - 1];
    size_ = static_cast<double>(std::max<std::size_t>(size, 1));
    settled_ = true;
    if (now_->each[0] > 0 && now_->each[0] * size_ < kLeast) return trial_ = way_ = false;
    const std::uint32_t phase = now_->times++ % kEvery;
    trial_ = phase < kTrial;
    // The first calls of a trial find the caches as the other way left them, so they do not count.
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
    // If the machine stole time from this call, it counts as twice the usual at most.
    each = each > 0 ? each + (trial_ ? 0.25 : 0.05) * (std::min(seen, 2 * each) - each) : seen;
    if (!(kind.each[0] > 0 && kind.each[1] > 0)) return;
    kind.shares = kind.each[1] < (kind.shares ? 1.0 : kGain) * kind.each[0];
  }

 private:
  static constexpr std::size_t kKinds = 24;     // classes of size, by powers of two
  static constexpr std::uint32_t kEvery = 512;  // calls until the other way is tried again
  static constexpr std::uint32_t kTrial = 8;    // calls of a trial
  static constexpr double kGain = 0.95;  // sharing begins below this part of one thread's time
  // Less work is never shared: a helper that polls begins 0.7 us later.
  static constexpr double kLeast = 3000;  // [ns]
  struct Kind {
    double each[2] = {};  // time of one item, on one thread and shared [ns]
    std::uint32_t times = 0;
    bool shares = true;
  } kinds_[kKinds];
  Kind* now_ = nullptr;
  double size_ = 0;
  bool trial_ = false, settled_ = false, way_ = false;
};

}  // namespace h6
