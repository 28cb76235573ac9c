// SPDX-License-Identifier: Apache-2.0
// latest_value.h - hands the newest value from one writer to one reader; neither ever waits.
//
// There are three slots: the writer owns one, the reader owns one, the third is the exchange.
// `middle_` holds the index of the exchange slot and whether that is newer than the reader's value.
// Large values can be written and read in place: next() and publish(), newest().
#pragma once
#include <atomic>
#include <cstdint>

namespace h6::sched {

template <class T>
class LatestValue {
 public:
  // Writer.
  void publish(const T& value) {
    slots_[back_] = value;
    publish();
  }
  // Writer. Fill the slot that next() gives, which holds an old value; publish() makes it the
  // newest.
  T& next() { return slots_[back_]; }
  void publish() { back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kIndex; }
  // Reader. True when there is a newer value than in the last call; otherwise `out` is unchanged.
  bool take(T& out) {
    const T* value = newest();
    if (value) out = *value;
    return value != nullptr;
  }
  // Reader. A newer value than in the last call, or nullptr. It is valid until the next call.
  const T* newest() {
    if (!(middle_.load(std::memory_order_relaxed) & kNew)) return nullptr;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &slots_[front_];
  }
  // Prepares all slots, before the first write or read.
  template <class F>
  void prepare(F&& each) {
    for (T& slot : slots_) each(slot);
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kNew = 4;
  T slots_[3] = {};
  alignas(64) std::atomic<std::uint8_t> middle_{1};
  alignas(64) std::uint8_t back_ = 0;   // the writer's
  alignas(64) std::uint8_t front_ = 2;  // the reader's
};

}  // namespace h6::sched
