// SPDX-License-Identifier: Apache-2.0
// samples.h - a vector for the samples of a field. It does not clear new elements, because all of
// them are written next, and it asks for large pages: a field of a gigabyte in pages of 4 KiB would
// cost a quarter of a million page faults. Its elements may also lie in a file (mapped_file.h).
#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace h6::io {

template <class T>
class SampleAllocator {
 public:
  using value_type = T;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;

  SampleAllocator() = default;
  // The first vector of `count` elements gets those at `place`; `owner` keeps them alive.
  SampleAllocator(std::shared_ptr<const void> owner, T* place, std::size_t count)
      : owner_(std::move(owner)), place_(place), count_(count) {}
  SampleAllocator(const SampleAllocator&) = default;  // a vector that was moved from stays whole
  SampleAllocator& operator=(const SampleAllocator&) = default;
  template <class U>
  SampleAllocator(const SampleAllocator<U>&) {}
  // A copy of a vector has memory of its own.
  SampleAllocator select_on_container_copy_construction() const { return {}; }

  T* allocate(std::size_t count) {
    if (place_ != nullptr && count == count_) return place_;
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
  void deallocate(T* room, std::size_t) noexcept {
    if (room != place_) std::free(room);
  }

  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    std::construct_at(at, std::forward<Values>(values)...);
  }
  bool operator==(const SampleAllocator& other) const { return place_ == other.place_; }

 private:
  std::shared_ptr<const void> owner_;
  T* place_ = nullptr;
  std::size_t count_ = 0;
};

// The same for elements of any type.
template <class T>
using Large = std::vector<T, SampleAllocator<T>>;
using Samples = Large<float>;

}  // namespace h6::io
