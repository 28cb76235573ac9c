// SPDX-License-Identifier: Apache-2.0
// session_slabs.h - memory for many sessions of one size, side by side in huge pages.
//
// Thousands of sessions have more pages of 4 kB than the processor's TLB holds, so an access that
// leaves the cache must often read the page table first. 16,384 sessions make 122,000 steps a
// second in pages of 2 MB, 107,000 to 115,000 in pages of 4 kB (peg-in-hole, two threads, AVX-512).
#pragma once
#include <cstddef>
#include <mutex>
#include <new>
#include <utility>

#include "runtime/base/arena.h"

namespace h6 {

// Any thread may call. No frame does. A slab ends when all of its pieces were given back. What is
// known of a slab stands at its begin and in its unused pieces, so slabs need no other memory.
class SessionSlabs {
 public:
  SessionSlabs() = default;
  SessionSlabs(const SessionSlabs&) = delete;
  SessionSlabs& operator=(const SessionSlabs&) = delete;
  ~SessionSlabs() {
    while (first_) release({}, std::exchange(first_, first_->next), kSlab);
  }

  // Memory of this size, aligned as by allocate. Null if there is none.
  void* take(std::size_t bytes) {
    if (bytes == 0 || bytes > kLargest) return allocate({}, bytes);
    const std::lock_guard lock(mutex_);
    const std::size_t each = (bytes + kAlignment - 1) / kAlignment * kAlignment;
    for (Slab* slab = first_; slab; slab = slab->next)
      if (slab->each == each && (slab->unused || slab->begun < pieces(*slab)))
        return take_from(*slab);
    void* const memory = allocate({}, kSlab);
    if (!memory) return nullptr;
    first_ = new (memory) Slab{first_, each};
    return take_from(*first_);
  }
  // Memory that `take` gave for this size.
  void give_back(void* memory, std::size_t bytes) {
    if (bytes == 0 || bytes > kLargest) return release({}, memory, bytes);
    const std::lock_guard lock(mutex_);
    for (Slab** link = &first_; *link; link = &(*link)->next) {
      Slab* const slab = *link;
      if (memory < begin(*slab) || memory >= begin(*slab) + kSlab) continue;
      slab->unused = new (memory) Unused{slab->unused};
      if (--slab->held > 0) return;
      *link = slab->next;
      return release({}, slab, kSlab);
    }
  }

 private:
  static constexpr std::size_t kSlab = 8 * kHugePage;
  // A slab holds at least two pieces. A larger piece would waste half of it.
  static constexpr std::size_t kLargest = (kSlab / kAlignment - 1) / 2 * kAlignment;
  struct Unused {
    Unused* next;
  };
  struct Slab {
    Slab* next;
    std::size_t each;          // bytes of a piece
    std::size_t begun = 0;     // pieces that were taken at least once; the others stay untouched
    std::size_t held = 0;      // pieces in use
    Unused* unused = nullptr;  // pieces that were given back
  };
  static_assert(sizeof(Slab) <= kAlignment);

  static char* begin(Slab& slab) { return reinterpret_cast<char*>(&slab); }
  static std::size_t pieces(const Slab& slab) { return (kSlab - kAlignment) / slab.each; }
  static void* take_from(Slab& slab) {
    ++slab.held;
    if (slab.unused) return std::exchange(slab.unused, slab.unused->next);
    return begin(slab) + kAlignment + slab.each * slab.begun++;
  }

  std::mutex mutex_;
  Slab* first_ = nullptr;
};

}  // namespace h6
