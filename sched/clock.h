// SPDX-License-Identifier: Apache-2.0
// clock.h - the two clocks of a haptic thread.
#pragma once
#include <cstdint>

namespace h6::sched {

// Nanoseconds of the monotonic clock. Read through the vDSO: no system call, allowed in a frame.
std::int64_t now_ns();

// A reading for spans of one thread within a frame. Where the processor has a counter of constant
// rate that is it (10 ns a reading where the clock takes 26), else the clock.
std::int64_t ticks();

// How long a tick is, from both read together now and then. After a second it starts anew: what a
// pause of the machine did to either is forgotten.
class TickLength {
 public:
  void see(std::int64_t now_ns, std::int64_t ticks);
  double ns() const { return ns_; }

 private:
  std::int64_t since_ns_ = 0, since_ticks_ = 0;
  bool known_ = false;  // of a whole second
  double ns_ = 1;
};

// Nanoseconds of CPU time that the calling thread has used. A system call: outside the frame only.
std::int64_t thread_cpu_ns();

// Sleeps until the monotonic clock shows `deadline_ns`; returns at once when that has passed.
void sleep_until_ns(std::int64_t deadline_ns);

}  // namespace h6::sched
