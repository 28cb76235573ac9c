// SPDX-License-Identifier: Apache-2.0
// periodic_thread.h - a thread that does one thing at absolute deadlines, and accounts for time.
//
//   deadline n          deadline n+1
//   |--wakeup--[=== tick ===]---sleep---[spin]|--
//
// Deadlines are n periods apart, so that a late frame does not delay the next ones. After more than
// a whole period is lost the schedule moves by whole ones: a burst of catch-up frames would be a
// jolt.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

#include "sched/realtime.h"

namespace h6::sched {

// Why a frame ended after its deadline: exactly one cause a late frame.
enum class Late {
  no,
  compute,  // the thread's own CPU time, without waiting for a helper, was over the period
  stolen,   // it was not, but the clock was: the machine ran something else
  wakeup,   // the frame was short enough, but began too late
};

// What the thread knows of the frame before, given to the next one and to `done`.
struct TickTiming {
  double wakeup_us = 0;  // start after the deadline
  Late late = Late::no;
  double late_us = 0;  // end after the next deadline, of a late one
  double cpu_us = 0;   // the thread's own CPU time
};

struct PeriodicThreadOptions {
  double rate = 1000;         // [Hz]
  double spin_us = 0;         // poll the clock this long before a deadline
  bool virtual_time = false;  // no clock, no sleep: frame after frame
  bool realtime = true;       // ask for real-time treatment
  RealtimeRequest request;
};

class PeriodicThread {
 public:
  // `tick` runs every period with its frame number and returns false to end. `done` runs after each
  // tick, outside the measured frame. `begin` runs first on the thread, with what was granted.
  struct Work {
    std::function<void(const RealtimeGrant&)> begin;
    std::function<bool(std::uint64_t frame, const TickTiming& before, double wakeup_us)> tick;
    std::function<void(std::uint64_t frame, const TickTiming& timing)> done;
  };

  PeriodicThread(const PeriodicThreadOptions& options, Work work);
  ~PeriodicThread();  // asks it to stop, and joins
  void request_stop() { stop_.store(true, std::memory_order_relaxed); }
  void join();
  bool running() const { return running_.load(std::memory_order_acquire); }

 private:
  void run();
  PeriodicThreadOptions options_;
  Work work_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> running_{true};
  std::thread thread_;
};

}  // namespace h6::sched
