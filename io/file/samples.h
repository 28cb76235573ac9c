// SPDX-License-Identifier: Apache-2.0
// samples.h - a vector for the samples of a field. It does not clear new elements, because all of
// them are written next, and it asks for large pages: a field of a gigabyte in pages of 4 KiB would
// cost a quarter of a million page faults.
#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace h6::io {

template <class T>
struct SampleAllocator {
  using value_type = T;
  SampleAllocator() = default;
  template <class U>
  SampleAllocator(const SampleAllocator<U>&) {}

  T* allocate(std::size_t count) {
    constexpr std::size_t kPage = std::size_t{2} << 20;
    if (count > (std::size_t{1} << 60) / sizeof(T)) throw std::bad_alloc();
    const std::size_t bytes = count * sizeof(T);
    const std::size_t align = bytes >= 2 * kPage ? kPage : 64;
    void* room = std::aligned_alloc(align, (bytes + align - 1) / align * align);
    if (room == nullptr) throw std::bad_alloc();
#ifdef __linux__
    if (align == kPage) madvise(room, bytes, MADV_HUGEPAGE);  // only a hint
#endif
    return static_cast<T*>(room);
  }
  void deallocate(T* room, std::size_t) noexcept { std::free(room); }

  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    std::construct_at(at, std::forward<Values>(values)...);
  }
  template <class U>
  bool operator==(const SampleAllocator<U>&) const {
    return true;
  }
};

// The same for elements of any type.
template <class T>
using Large = std::vector<T, SampleAllocator<T>>;
using Samples = Large<float>;

}  // namespace h6::io
