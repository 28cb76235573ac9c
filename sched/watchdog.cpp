// SPDX-License-Identifier: Apache-2.0
// watchdog.cpp - the watchdog's thread.
#include "sched/watchdog.h"

#include <pthread.h>
#include <sched.h>

#include <chrono>

#include "sched/clock.h"

namespace h6::sched {

Watchdog::Watchdog(std::int64_t timeout_ns, int priority, std::function<void()> expired)
    : timeout_(timeout_ns), expired_(std::move(expired)), thread_([=, this] { run(priority); }) {}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void Watchdog::sleep_ns(std::int64_t duration) {
  std::unique_lock lock(mutex_);
  ended_.wait_for(lock, std::chrono::nanoseconds(duration), [this] { return end_; });
}

void Watchdog::run(int priority) {
  if (priority > 0) {
    // Above the watched thread, which may spin for ever on a core that both need.
    sched_param parameters{};
    parameters.sched_priority = priority;
    (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  }
  const auto ends = [this] {
    const std::lock_guard lock(mutex_);
    return end_;
  };
  std::int64_t expired_beat = 0;  // the last beat before the stall that was counted last
  while (!ends()) {
    const std::int64_t beat = beat_.load(std::memory_order_relaxed), now = now_ns();
    if (beat == 0 || now < beat + timeout_) {
      sleep_ns(beat == 0 ? timeout_ : beat + timeout_ - now);
      continue;
    }
    if (beat != expired_beat) trips_.fetch_add(1);
    expired_beat = beat;
    expired_();
    sleep_ns(timeout_);
  }
}

}  // namespace h6::sched
