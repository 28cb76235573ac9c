// SPDX-License-Identifier: Apache-2.0
// wake_ahead.h - places deadlines, and decides when the sleep before one ends, so that the spin is
// as long as requested.
//
//   end of frame   aim()        woken       deadline
//   |----sleep-----|--machine---|---spin----|
//       tick
//
// A machine wakes a sleeper late, by 5 to 150 us. The delay grows with the length of the sleep and
// changes from hour to hour. The aim follows it so that half of all sleeps end before the spin
// begins.
//
// The kernel's tick takes 5 to 60 us of a core, 100 to 1000 times a second. Since Linux 6.4 it
// comes at whole multiples of its period on the monotonic clock. Deadlines keep a distance from
// these, so that the tick comes while the thread sleeps and not during its spin.
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

  // The first good place for a deadline at `time` or later.
  std::int64_t place(std::int64_t time) const {
    const std::int64_t after_tick = (spin_ + kTick) % period_;
    return time + (after_tick - time % period_ + period_) % period_;
  }

  // When to end the sleep. Not after `now`: there is no time to sleep.
  std::int64_t aim(std::int64_t now, std::int64_t deadline) const {
    const std::int64_t latest = deadline - spin_;
    if (now >= latest) return now;
    // The kernel gives real-time threads 95 % of a core and stops a greedier one for 50 ms.
    return std::min(latest, std::max(latest - early_, now + rest_));
  }
  // The sleep was to end at `aimed` and ended at `woken`. Follows the median, so that a stolen
  // millisecond is one step.
  void learn(std::int64_t aimed, std::int64_t woken) {
    early_ = std::clamp(early_ + (woken - aimed > early_ ? step_ : -step_), std::int64_t{0}, spin_);
  }
  std::int64_t early() const { return early_; }

 private:
  static constexpr std::int64_t kTick = 50000;  // what the kernel's tick may take [ns]
  std::int64_t period_, spin_, rest_, step_;
  std::int64_t early_ = 0;  // how long before the spin the sleep ends, at most spin_ [ns]
};

}  // namespace h6::sched
