// SPDX-License-Identifier: Apache-2.0
// mailbox.h - between a plug-in's own thread, which talks to a device, and the haptic thread. Neither
// waits for the other, and neither allocates here.
//
//   own thread --put--> newest sample --get--> haptic thread
//   own thread <--wrench-- newest command <--command-- haptic thread
//
// The wrench is zero after stop, and where no command came for 20 ms: a host that hangs renders no
// force.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>

#include "device/plugins/grip.h"

namespace h6::plugin {

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The last value written by one thread, for one that reads: the reader tries again while it is being
// written (a sequence lock; words are atomic, so there is no race).
template <class T>
class Latest {
  static_assert(sizeof(T) % 8 == 0 && std::is_trivially_copyable_v<T>);
  static constexpr std::size_t kWords = sizeof(T) / 8;

 public:
  void put(const T& value) {
    std::uint64_t words[kWords];
    std::memcpy(words, &value, sizeof value);
    const std::uint32_t turn = turn_.load(std::memory_order_relaxed);
    turn_.store(turn + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
    turn_.store(turn + 2, std::memory_order_release);
  }
  // False when it was being written at every one of a few tries; `out` is unchanged then.
  bool get(T& out) const {
    for (int attempt = 0; attempt < 100; ++attempt) {
      const std::uint32_t turn = turn_.load(std::memory_order_acquire);
      std::uint64_t words[kWords];
      for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (turn % 2 || turn_.load(std::memory_order_relaxed) != turn) continue;
      std::memcpy(&out, words, sizeof out);
      return true;
    }
    return false;
  }

 private:
  std::atomic<std::uint32_t> turn_{0};
  std::atomic<std::uint64_t> words_[kWords] = {};
};

struct Heard {
  Grip grip{};
  double at = 0;  // when it came [s]; 0: nothing is known of the device
  std::uint64_t buttons = 0, sequence = 0;
};
struct Wanted {
  double force[3] = {}, torque[3] = {};
  double at = 0;  // [s]
  std::uint64_t cause = 0;
};

class Mailbox {
 public:
  static constexpr double kSilence = 0.02;  // of the host [s]

  // The device's thread.
  void put(const Heard& heard) { heard_.put(heard); }
  void lose() { heard_.put({}); }  // until the next put
  Wanted wrench() const {
    Wanted w;
    if (!wanted_.get(w) || stopped_.load() || now() - w.at > kSilence) {
      const std::uint64_t cause = w.cause;
      w = {};
      w.cause = cause;
    }
    return w;
  }

  // The haptic thread. `patience`: the oldest sample that counts [s]. False: the device is lost.
  bool get(const h6PluginStart& start, double patience, h6PluginSample* out) {
    heard_.get(last_);
    if (last_.at == 0 || now() - last_.at > patience) return false;
    h6_sample_of_grip(&start, &last_.grip, out);
    out->buttons = static_cast<std::uint32_t>(last_.buttons);
    out->sequence = static_cast<std::uint32_t>(last_.sequence);
    return true;
  }
  void command(const h6PluginCommand& c) {
    Wanted w;
    std::memcpy(w.force, c.force, sizeof w.force);
    std::memcpy(w.torque, c.torque, sizeof w.torque);
    w.at = now();
    w.cause = c.cause;
    wanted_.put(w);
  }
  // Any thread, and signal handlers.
  void stop() { stopped_.store(true); }
  void arm() { stopped_.store(false); }

 private:
  Latest<Heard> heard_;
  Latest<Wanted> wanted_;
  Heard last_;  // of the haptic thread
  std::atomic<bool> stopped_{false};
};

}  // namespace h6::plugin
