// SPDX-License-Identifier: Apache-2.0
// realtime.h - requests real-time treatment for the calling thread and reports what was granted.
#pragma once
#include <cstddef>

namespace h6::sched {

struct RealtimeRequest {
  int core = -1;      // -1: the last one that the thread may use
  int priority = 80;  // SCHED_FIFO, 1 .. 99
};

struct RealtimeGrant {
  bool pinned = false, fifo = false, locked = false;
  int core = -1;
  bool isolated = false;   // the scheduler by itself puts nothing else on that core
  char governor[32] = "";  // of the core's clock; "" where the kernel does not tell
  char text[1024] = "";    // one sentence an item; for a refusal it says how to get the item
};

// Pins the calling thread, makes it SCHED_FIFO, locks the memory that the process has now, and
// touches some stack. A refusal is reported and never fatal.
RealtimeGrant request_realtime(const RealtimeRequest& request);
// Unlocks the memory. The thread's own attributes end with the thread.
void release_realtime(const RealtimeGrant& grant);

// Flushes denormal numbers to zero while in scope; each would cost a hundred cycles.
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
