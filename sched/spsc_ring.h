// SPDX-License-Identifier: Apache-2.0
// spsc_ring.h - one writer, one reader, fixed capacity; neither ever waits.
//
// The two cursors only grow; a slot is cursor % capacity. The writer keeps a copy of the reader's
// cursor on its own cache line, so that a push into a half-full ring touches no shared line.
#pragma once
#include <atomic>
#include <cstddef>

namespace h6::sched {

template <class T>
class SpscRing {
 public:
  // `slots` has room for `capacity` values and outlives the ring.
  SpscRing(T* slots, std::size_t capacity) : slots_(slots), capacity_(capacity) {}

  // Writer. False when the ring is full; the value is then dropped.
  bool push(const T& value) {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    if (at - seen_read_ == capacity_) {
      seen_read_ = read_.load(std::memory_order_acquire);
      if (at - seen_read_ == capacity_) return false;
    }
    slots_[at % capacity_] = value;
    written_.store(at + 1, std::memory_order_release);
    return true;
  }
  // Writer. Would a push be dropped now?
  bool full() {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    seen_read_ = read_.load(std::memory_order_acquire);
    return at - seen_read_ == capacity_;
  }

  // Writer. Is there room for `count` more?
  bool room_for(std::size_t count) {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    if (at - seen_read_ + count > capacity_) seen_read_ = read_.load(std::memory_order_acquire);
    return at - seen_read_ + count <= capacity_;
  }

  // Reader. The oldest value; null: there is none. It stays until it is popped.
  const T* front() const {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    return written_.load(std::memory_order_acquire) == at ? nullptr : &slots_[at % capacity_];
  }
  // Reader. Moves up to `room` values out, the oldest first, and returns how many.
  std::size_t pop(T* out, std::size_t room) {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    const std::size_t there = written_.load(std::memory_order_acquire) - at;
    const std::size_t count = there < room ? there : room;
    for (std::size_t i = 0; i < count; ++i) out[i] = slots_[(at + i) % capacity_];
    read_.store(at + count, std::memory_order_release);
    return count;
  }

 private:
  T* slots_;
  std::size_t capacity_;
  alignas(64) std::atomic<std::size_t> written_{0};
  std::size_t seen_read_ = 0;  // the writer's copy of read_
  alignas(64) std::atomic<std::size_t> read_{0};
};

}  // namespace h6::sched
