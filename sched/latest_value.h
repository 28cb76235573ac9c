// latest_value.h - hands the newest value from one writer to one reader; neither ever waits.
//
// Three slots: the writer owns one, the reader owns one, the third is the exchange. `middle_` holds
// the index of the exchange slot and whether it is newer than what the reader has.
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
    back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kIndex;
  }
  // Reader. True when there is a value newer than that of the last call; `out` is left alone if
  // not.
  bool take(T& out) {
    if (!(middle_.load(std::memory_order_relaxed) & kNew)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    out = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kNew = 4;
  T slots_[3] = {};
  alignas(64) std::atomic<std::uint8_t> middle_{1};
  alignas(64) std::uint8_t back_ = 0;   // the writer's
  alignas(64) std::uint8_t front_ = 2;  // the reader's
};

}  // namespace h6::sched
