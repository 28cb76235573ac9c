// SPDX-License-Identifier: Apache-2.0
// pulse.h - whether work shall go on: cheap enough to ask anywhere in it, from any thread.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <thread>

#include "io/file/progress.h"

namespace h6::io {

// Between the loops of some work and the Progress it was given. Progress is heard only on the
// thread that made the pulse, at most every 20 ms; the answer reaches all others.
class Pulse {
 public:
  explicit Pulse(const Progress& progress) : progress_(progress) {}
  Pulse(const Pulse&) = delete;
  Pulse& operator=(const Pulse&) = delete;

  // The owner's thread only: what is done next, and which part of the whole that is.
  bool step(const char* what, double from, double to) {
    what_ = what, from_ = from, to_ = to, share_ = 0;
    return tell();
  }
  void share(double done) { share_ = done < 1 ? done : 1; }  // of the step
  // For work that has a Progress of its own.
  Progress part() {
    return [this](const std::string& what, double done) {
      if (stopped_) return false;
      share(done);
      heard_ = Clock::now();
      if (progress_ && !progress_(what, from_ + (to_ - from_) * share_)) stopped_ = true;
      return !stopped_.load();
    };
  }

  // False: stop, and leave whatever is half made. A hundred calls a millisecond cost nothing.
  bool alive() {
    if (stopped_.load(std::memory_order_relaxed)) return false;
    if (!progress_ || std::this_thread::get_id() != owner_) return true;
    return Clock::now() - heard_ < std::chrono::milliseconds(20) || tell();
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool tell() {
    heard_ = Clock::now();
    if (progress_ && !stopped_ && !progress_(what_, from_ + (to_ - from_) * share_))
      stopped_ = true;
    return !stopped_;
  }

  const Progress& progress_;
  const std::thread::id owner_ = std::this_thread::get_id();
  std::atomic<bool> stopped_{false};
  const char* what_ = "";
  double from_ = 0, to_ = 0, share_ = 0;
  Clock::time_point heard_{};
};

// For loops that may run without a pulse.
inline bool alive(Pulse* pulse) { return !pulse || pulse->alive(); }

}  // namespace h6::io
