// SPDX-License-Identifier: Apache-2.0
// periodic_thread.h - a thread that runs a tick at absolute deadlines and measures its timing.
//
//   deadline n          deadline n+1
//   |--wakeup--[=== tick ===]---sleep---[spin]|--
//
// Deadlines are whole periods apart, so that a late frame does not delay the next ones. When more
// than a period is lost the schedule moves on: a burst of catch-up frames would be felt as a jolt.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

#include "sched/realtime.h"

namespace h6::sched {

// Why a frame ended after its deadline. Every late frame has exactly one cause.
enum class Late {
  no,
  compute,  // the thread's own CPU time, without waiting for a helper, exceeded the period
  stolen,   // only the wall time did: the machine ran something else
  wakeup,   // the frame was short enough but began too late
};

// The timing of one frame, given to the next tick and to `done`.
struct TickTiming {
  double wakeup_us = 0;  // start after the deadline
  Late late = Late::no;
  double late_us = 0;  // a late frame's end after the next deadline
  double cpu_us = 0;   // CPU time of the thread
};

struct PeriodicThreadOptions {
  double rate = 1000;         // [Hz]
  double spin_us = 0;         // how long to poll the clock before a deadline
  bool virtual_time = false;  // frame after frame, without clock or sleep
  bool realtime = true;       // request real-time treatment
  RealtimeRequest request;
};

class PeriodicThread {
 public:
  // `begin` runs first on the thread, with what the system granted. `tick` runs every period with
  // its frame number and returns false to end. `done` runs after each tick, outside the measured
  // frame.
  struct Work {
    std::function<void(const RealtimeGrant&)> begin;
    std::function<bool(std::uint64_t frame, const TickTiming& before, double wakeup_us)> tick;
    std::function<void(std::uint64_t frame, const TickTiming& timing)> done;
  };

  PeriodicThread(const PeriodicThreadOptions& options, Work work);
  ~PeriodicThread();  // asks it to stop, and joins
  void request_stop() { stop_.store(true, std::memory_order_relaxed); }
  void join();
  bool is_this() const { return id_.load() == std::this_thread::get_id(); }
  bool running() const { return running_.load(std::memory_order_acquire); }

 private:
  void run();
  PeriodicThreadOptions options_;
  Work work_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> running_{true};
  std::atomic<std::thread::id> id_{};  // while it runs; any thread may ask while another one joins
  std::thread thread_;
};

}  // namespace h6::sched
