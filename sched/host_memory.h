// SPDX-License-Identifier: Apache-2.0
// host_memory.h - lets the library's containers take memory from the embedding program.
//
// A call of the contract that has an h6Allocator opens a scope. Containers that are made in it, on
// that thread, belong to that allocator for their whole life. Outside of any scope, and on other
// threads, they take the C++ heap. Threads, and what TBB and the C library keep for them, always
// do.
#pragma once
#include <cstddef>
#include <limits>
#include <new>
#include <vector>

#include "hapsix/base.h"

namespace h6::sched {

class HostScope {
 public:
  explicit HostScope(const h6Allocator& a);
  ~HostScope();
  HostScope(const HostScope&) = delete;
  HostScope& operator=(const HostScope&) = delete;

  static const h6Allocator& current();

 private:
  h6Allocator before_;
};

template <class T>
class HostMemory {
 public:
  using value_type = T;
  HostMemory() : from_(HostScope::current()) {}
  template <class U>
  HostMemory(const HostMemory<U>& other) : from_(other.from()) {}

  T* allocate(std::size_t count) {
    constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max() - alignment();
    if (count > kMost / sizeof(T)) throw std::bad_alloc();
    void* const memory = has() ? from_.allocate(from_.user, bytes_of(count), alignment())
                               : ::operator new (bytes_of(count), std::align_val_t{alignment()});
    if (!memory) throw std::bad_alloc();
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) {
    if (has())
      from_.release(from_.user, memory, bytes_of(count));
    else
      ::operator delete (memory, std::align_val_t{alignment()});
  }
  const h6Allocator& from() const { return from_; }
  bool operator==(const HostMemory& o) const {
    return from_.allocate == o.from_.allocate && from_.release == o.from_.release &&
           from_.user == o.from_.user;
  }

 private:
  static constexpr std::size_t alignment() { return alignof(T) > 64 ? alignof(T) : 64; }
  // A multiple of the alignment, as aligned_alloc of the C library wants it.
  static constexpr std::size_t bytes_of(std::size_t count) {
    return (count * sizeof(T) + alignment() - 1) / alignment() * alignment();
  }
  bool has() const { return from_.allocate && from_.release; }
  h6Allocator from_;
};

template <class T>
using HostVector = std::vector<T, HostMemory<T>>;

}  // namespace h6::sched
