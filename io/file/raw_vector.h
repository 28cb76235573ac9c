// SPDX-License-Identifier: Apache-2.0
// raw_vector.h - a vector that does not clear new elements, for loops that write all of them next.
// Clearing gigabytes on one thread would take a second in which the user cannot cancel.
#pragma once
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace h6::io {

template <class T>
struct RawAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = RawAllocator<U>;
  };
  template <class U>
  void construct(U* at) noexcept {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
  }
};

template <class T>
using RawVector = std::vector<T, RawAllocator<T>>;

}  // namespace h6::io
