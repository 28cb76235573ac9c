// SPDX-License-Identifier: Apache-2.0
// session_slabs.h - memory for many sessions of one size, side by side in huge pages.
//
// Thousands of sessions have more pages of 4 kB than the processor's TLB holds, so an access that
// leaves the cache must often read the page table first. 16,384 sessions make 122,000 steps a
// second in pages of 2 MB, 107,000 to 115,000 in pages of 4 kB (peg-in-hole, two threads, AVX-512).
#pragma once
#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include "runtime/base/arena.h"

namespace h6 {

// Any thread may call. No frame does. A slab ends when all of its pieces were given back.
class SessionSlabs {
 public:
  SessionSlabs() = default;
  SessionSlabs(const SessionSlabs&) = delete;
  SessionSlabs& operator=(const SessionSlabs&) = delete;
  ~SessionSlabs() {
    for (const Slab& slab : slabs_) release({}, slab.memory, kSlab);
  }

  // Memory of this size, aligned as by allocate. Null if there is none. May throw std::bad_alloc;
  // then nothing has changed.
  void* take(std::size_t bytes) {
    if (bytes == 0 || bytes > kSlab / 2) return allocate({}, bytes);
    const std::lock_guard lock(mutex_);
    const std::size_t each = (bytes + kAlignment - 1) / kAlignment * kAlignment;
    for (std::size_t i = slabs_.size(); i-- > 0;)
      if (slabs_[i].each == each && !slabs_[i].unused.empty()) return take_from(slabs_[i]);
    std::vector<char*> unused(kSlab / each);
    Slab& slab = slabs_.emplace_back(Slab{nullptr, each, {}});
    slab.memory = static_cast<char*>(allocate({}, kSlab));
    if (!slab.memory) return slabs_.pop_back(), nullptr;
    for (std::size_t i = 0; i < unused.size(); ++i) unused[i] = slab.memory + each * i;
    slab.unused = std::move(unused);  // it never grows, so to give back needs no memory
    return take_from(slab);
  }
  // Memory that `take` gave for this size.
  void give_back(void* memory, std::size_t bytes) {
    if (bytes == 0 || bytes > kSlab / 2) return release({}, memory, bytes);
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < slabs_.size(); ++i) {
      Slab& slab = slabs_[i];
      if (memory < slab.memory || memory >= slab.memory + kSlab) continue;
      slab.unused.push_back(static_cast<char*>(memory));
      if (slab.unused.size() < kSlab / slab.each) return;
      release({}, slab.memory, kSlab);
      slabs_.erase(slabs_.begin() + static_cast<std::ptrdiff_t>(i));
      return;
    }
  }

 private:
  static constexpr std::size_t kSlab = 8 * kHugePage;
  struct Slab {
    char* memory;
    std::size_t each;           // bytes of a piece
    std::vector<char*> unused;  // pieces
  };

  static void* take_from(Slab& slab) {
    void* const piece = slab.unused.back();
    slab.unused.pop_back();
    return piece;
  }

  std::mutex mutex_;
  std::vector<Slab> slabs_;
};

}  // namespace h6
