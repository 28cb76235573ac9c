// SPDX-License-Identifier: Apache-2.0
// watchdog.h - a thread that acts when another thread stops giving signs of life.
//
// The watchdog sleeps from one possible expiry to the next, so that a beat costs one store and no
// wake-up.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace h6::sched {

class Watchdog {
 public:
  // Calls `expired` on the watchdog's thread when no beat has come for `timeout_ns`, and again
  // every `timeout_ns` until one comes. The thread requests SCHED_FIFO of this priority (0: none)
  // and works without it too.
  Watchdog(std::int64_t timeout_ns, int priority, std::function<void()> expired);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // For the watched thread. Nothing expires before the first beat or after a rest.
  void beat(std::int64_t now_ns) { beat_.store(now_ns, std::memory_order_relaxed); }
  void rest() { beat_.store(0, std::memory_order_relaxed); }

  // How many times the watched thread was found stalled. Grows before `expired` is called.
  std::uint64_t trips() const { return trips_.load(); }

 private:
  void run(int priority);
  void sleep_ns(std::int64_t duration);

  const std::int64_t timeout_;
  const std::function<void()> expired_;
  std::atomic<std::int64_t> beat_{0};
  std::atomic<std::uint64_t> trips_{0};
  std::mutex mutex_;  // guards end_ only; the watched thread never takes it
  std::condition_variable ended_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace h6::sched
