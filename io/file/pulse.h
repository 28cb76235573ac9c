// SPDX-License-Identifier: Apache-2.0
// pulse.h - whether long work was cancelled; cheap enough for inner loops and any thread.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <thread>

#include "io/file/progress.h"

namespace h6::io {

// Stands between the loops of some work and its Progress. It calls Progress only on the thread that
// made the pulse, at most every 20 ms; all threads see the answer.
class Pulse {
 public:
  explicit Pulse(const Progress& progress) : progress_(progress) {}
  Pulse(const Pulse&) = delete;
  Pulse& operator=(const Pulse&) = delete;

  // Begins a step and names it; it takes the work from `from` to `to` in [0, 1]. The owner's thread
  // only.
  bool step(const char* what, double from, double to) {
    what_ = what, from_ = from, to_ = to, share_ = 0;
    return tell();
  }
  void share(double done) { share_ = done < 1 ? done : 1; }  // how much of the step is done
  // A Progress for work inside this step.
  Progress part() {
    return [this](const std::string& what, double done) {
      if (stopped_) return false;
      share(done);
      heard_ = Clock::now();
      if (progress_ && !progress_(what, from_ + (to_ - from_) * share_)) stopped_ = true;
      return !stopped_.load();
    };
  }

  // False once the work is cancelled. The caller must then return at once, even with a result half
  // made. A hundred calls a millisecond cost nothing.
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

// For loops with an optional pulse.
inline bool alive(Pulse* pulse) { return !pulse || pulse->alive(); }

}  // namespace h6::io
