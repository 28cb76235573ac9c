// SPDX-License-Identifier: Apache-2.0
// clock.h - the clocks of a haptic thread: wall time, fast ticks, CPU time.
#pragma once
#include <cstdint>

namespace h6::sched {

// Nanoseconds of the monotonic clock. The vDSO reads it without a system call, so a frame may.
std::int64_t now_ns();

// A reading for time spans within one frame on one thread: the processor's counter where its rate
// is constant (10 ns a reading), else the clock (26 ns).
std::int64_t ticks();

// The length of a tick, from pairs of readings of both clocks. It is measured anew every second, so
// that a pause of the machine does not spoil it for ever.
class TickLength {
 public:
  void see(std::int64_t now_ns, std::int64_t ticks);
  double ns() const { return ns_; }

 private:
  std::int64_t since_ns_ = 0, since_ticks_ = 0;
  bool known_ = false;  // of a whole second
  double ns_ = 1;
};

// CPU time of the calling thread [ns]. A system call, so only outside the frame.
std::int64_t thread_cpu_ns();

// Sleeps until the monotonic clock shows `deadline_ns`; returns at once if that has passed.
void sleep_until_ns(std::int64_t deadline_ns);

}  // namespace h6::sched
