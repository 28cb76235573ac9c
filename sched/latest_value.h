// SPDX-License-Identifier: Apache-2.0
// latest_value.h - hands the newest value from one writer to one reader; neither ever waits.
//
// Three slots: the writer owns one, the reader owns one, the third is the exchange. `middle_` holds
// the index of the exchange slot and whether it is newer than what the reader has. Large values are
// written and read where they lie: next() and publish(), newest().
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
  // Writer. The slot to fill, with whatever it held; then it is the newest.
  T& next() { return slots_[back_]; }
  void publish() { back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kIndex; }
  // Reader. True when there is a value newer than that of the last call; `out` is left alone if
  // not.
  bool take(T& out) {
    const T* value = newest();
    if (value) out = *value;
    return value != nullptr;
  }
  // Reader. A value newer than that of the last call, or nullptr; it stays until the next call.
  const T* newest() {
    if (!(middle_.load(std::memory_order_relaxed) & kNew)) return nullptr;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &slots_[front_];
  }
  // Before anyone writes or reads.
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
