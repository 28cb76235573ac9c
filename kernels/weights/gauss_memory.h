// SPDX-License-Identifier: Apache-2.0
// gauss_memory.h - lays out the columns of gauss_tree.h and gauss_sweep.h in one block.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

inline constexpr std::size_t kGaussAlign = 64;

// Hands out columns of a block, or, without a block, only counts their bytes.
struct GaussColumns {
  char* at;
  std::size_t used = 0;

  // A block at any address; block_bytes includes room for alignment.
  static GaussColumns in(void* memory) {
    const auto address = reinterpret_cast<std::uintptr_t>(memory);
    return {static_cast<char*>(memory) + (kGaussAlign - address % kGaussAlign) % kGaussAlign};
  }
  std::size_t block_bytes() const { return used + kGaussAlign; }

  template <class T>
  void take(T*& column, std::size_t rows) {
    column = at != nullptr ? reinterpret_cast<T*>(at + used) : nullptr;
    used += (rows * sizeof(T) + kGaussAlign - 1) / kGaussAlign * kGaussAlign;
  }
};

}  // namespace h6::kernels
