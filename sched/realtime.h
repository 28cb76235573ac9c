// SPDX-License-Identifier: Apache-2.0
// realtime.h - asks the machine for real-time treatment of the calling thread, and says what it
// got.
#pragma once
#include <cstddef>

namespace h6::sched {

struct RealtimeRequest {
  int core = -1;      // -1: the machine's last one
  int priority = 80;  // SCHED_FIFO, 1 .. 99
};

struct RealtimeGrant {
  bool pinned = false, fifo = false, locked = false;
  int core = -1;
  bool isolated = false;   // the scheduler puts nothing else on that core by itself
  char governor[32] = "";  // of its clock; "" where the kernel does not say
  char text[1024] = "";    // one sentence an item, with the way to get what was refused
};

// Pins the calling thread, makes it SCHED_FIFO, locks the memory that the process has now and
// touches some stack. What is refused is reported, never fatal.
RealtimeGrant request_realtime(const RealtimeRequest& request);
// Unlocks memory; the thread's own attributes end with the thread.
void release_realtime(const RealtimeGrant& grant);

// Denormal numbers cost a hundred cycles each: flush them to zero while in scope.
class FlushDenormals {
 public:
  FlushDenormals();
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned long saved_;
};

}  // namespace h6::sched
