// SPDX-License-Identifier: Apache-2.0
// slices.h - how a kernel with several passes has its slices run by the caller's threads.
#pragma once
#include <cstddef>
#include <type_traits>

namespace h6::kernels {

// run(self, slices, work, context) calls work(context, i) once for every i below `slices`, on any
// threads and in any order, and returns when all calls have returned. Null: this thread, in order.
struct SliceRunner {
  using Work = void (*)(void* context, std::size_t slice);
  void (*run)(void* self, std::size_t slices, Work work, void* context) = nullptr;
  void* self = nullptr;

  template <class F>
  void operator()(std::size_t slices, F& work) const {
    if (run == nullptr || slices < 2) {
      for (std::size_t i = 0; i < slices; ++i) work(i);
      return;
    }
    run(
        self, slices, [](void* context, std::size_t i) { (*static_cast<F*>(context))(i); }, &work);
  }
};

}  // namespace h6::kernels
