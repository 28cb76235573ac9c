// SPDX-License-Identifier: Apache-2.0
// wake_ahead.h - where deadlines lie, and when to end the sleep before one, so that the spin is as
// long as it was asked to be.
//
//   end of frame   aim()        woken       deadline
//   |----sleep-----|--machine---|---spin----|
//       tick
//
// A machine wakes a sleeper late: by 5 us or by 150, the more the longer it slept, and otherwise
// from hour to hour. Half of all sleeps are to end before the spin begins.
//
// The kernel's tick takes 5 to 60 us of a core, 100 to 1000 times a second. Since Linux 6.4 it
// comes at whole multiples of its period on the monotonic clock. Deadlines keep a distance from
// these, so that it comes while the thread sleeps; at random, every second thread would have it in
// its spin.
#pragma once
#include <algorithm>
#include <cstdint>

namespace h6::sched {

class WakeAhead {
 public:
  WakeAhead(std::int64_t period_ns, std::int64_t spin_ns)
      : period_(period_ns),
        spin_(spin_ns),
        rest_(period_ns / 16),
        step_(std::max<std::int64_t>(spin_ns / 100, 1)) {}

  // The first place for a deadline at `time` or after it.
  std::int64_t place(std::int64_t time) const {
    const std::int64_t after_tick = (spin_ + kTick) % period_;
    return time + (after_tick - time % period_ + period_) % period_;
  }

  // What to sleep until; not after `now`: there is no time for it.
  std::int64_t aim(std::int64_t now, std::int64_t deadline) const {
    const std::int64_t latest = deadline - spin_;
    if (now >= latest) return now;
    // The kernel gives real-time threads 95 % of a core, and stops for 50 ms who wants more.
    return std::min(latest, std::max(latest - early_, now + rest_));
  }
  // It was to be `aimed`, and is `woken`. Follows the median: a stolen millisecond is one step.
  void learn(std::int64_t aimed, std::int64_t woken) {
    early_ = std::clamp(early_ + (woken - aimed > early_ ? step_ : -step_), std::int64_t{0}, spin_);
  }
  std::int64_t early() const { return early_; }

 private:
  static constexpr std::int64_t kTick = 50000;  // ns that it may take
  std::int64_t period_, spin_, rest_, step_;
  std::int64_t early_ = 0;  // before the spin; never more than that [ns]
};

}  // namespace h6::sched
