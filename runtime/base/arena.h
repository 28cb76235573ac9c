// SPDX-License-Identifier: Apache-2.0
// arena.h - storage that is sized once.
//
// A layout function takes its columns from an Arena twice: first from an empty arena, which only
// counts, then from one over memory of the counted size. So capacity and use always agree.
#pragma once
#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <utility>

#include "hapsix/base.h"

namespace h6 {

inline constexpr std::size_t kAlignment = 64;
inline constexpr std::size_t kHugePage = 2 << 20;

inline void* allocate(const h6Allocator& a, std::size_t bytes) {
  bytes = (bytes + kAlignment - 1) & ~(kAlignment - 1);
  if (a.allocate && a.release) return a.allocate(a.user, bytes, kAlignment);
  if (bytes < kHugePage) return std::aligned_alloc(kAlignment, bytes ? bytes : kAlignment);
  // A frame reads fields all over. With 4 kB pages the page table costs a good part of a cold
  // frame.
  const std::size_t whole = (bytes + kHugePage - 1) & ~(kHugePage - 1);
  void* memory = std::aligned_alloc(kHugePage, whole);
#ifdef MADV_HUGEPAGE
  if (memory) madvise(memory, whole, MADV_HUGEPAGE);  // may be refused
#endif
  return memory;
}
inline void release(const h6Allocator& a, void* memory, std::size_t bytes) {
  if (!memory) return;
  bytes = (bytes + kAlignment - 1) & ~(kAlignment - 1);
  if (a.allocate && a.release)
    a.release(a.user, memory, bytes);
  else
    std::free(memory);
}

template <class T, class... A>
T* create(const h6Allocator& a, A&&... arguments) {
  void* memory = allocate(a, sizeof(T));
  if (!memory) return nullptr;
  try {
    return new (memory) T(std::forward<A>(arguments)...);
  } catch (...) {
    release(a, memory, sizeof(T));
    throw;
  }
}
template <class T>
void destroy(const h6Allocator& a, T* object) {
  if (!object) return;
  object->~T();
  release(a, object, sizeof(T));
}

// `count` values of a type that needs no constructor.
template <class T>
struct Buffer {
  h6Allocator allocator{};
  T* data = nullptr;
  std::size_t count = 0;

  Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { release(allocator, data, count * sizeof(T)); }
  bool reserve(const h6Allocator& a, std::size_t n) {
    release(allocator, data, count * sizeof(T));
    allocator = a;
    data = n <= SIZE_MAX / sizeof(T) - kAlignment ? static_cast<T*>(allocate(a, n * sizeof(T)))
                                                  : nullptr;
    count = data ? n : 0;
    return data != nullptr;
  }
  T& operator[](std::size_t i) { return data[i]; }
  const T& operator[](std::size_t i) const { return data[i]; }
};

class Arena {
 public:
  static constexpr std::size_t kTooMuch = SIZE_MAX / 4;  // used() of what cannot be counted
  Arena() = default;                                     // counts only
  Arena(void* memory, std::size_t bytes) : base_(static_cast<char*>(memory)), capacity_(bytes) {}
  template <class T>
  T* take(std::size_t n) {
    const std::size_t at = (used_ + kAlignment - 1) & ~(kAlignment - 1);
    if (at < used_ || n > (kTooMuch - std::min(at, kTooMuch)) / sizeof(T)) {
      used_ = kTooMuch;  // no allocator gives that
      return nullptr;
    }
    used_ = at + n * sizeof(T);
    if (!base_) return nullptr;
    H6_ASSERT(used_ <= capacity_);
    return reinterpret_cast<T*>(base_ + at);
  }
  std::size_t used() const { return used_; }
  // What is taken next lies over what was taken since used() was `at`.
  void go_back(std::size_t at) {
    if (used_ != kTooMuch) used_ = at;
  }
  void go_on(std::size_t at) { used_ = std::max(used_, at); }  // behind both

 private:
  char* base_ = nullptr;
  std::size_t used_ = 0, capacity_ = 0;
};

}  // namespace h6
