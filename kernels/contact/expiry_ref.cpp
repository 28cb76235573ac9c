// SPDX-License-Identifier: Apache-2.0
// expiry_ref.cpp - the specification of expiry.
#include <algorithm>

#include "kernels/contact/expiry.h"

namespace h6::kernels {

std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        float now, std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * (blocks != nullptr ? blocks[k] : k);
    for (std::size_t i = first; i < first + kBlock; ++i)
      if (values[i] <= now) out[written++] = static_cast<std::uint32_t>(i);
  }
  return written;
}

void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out) {
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    out[blocks[k]] = *std::min_element(first, first + kBlock);
  }
}

}  // namespace h6::kernels
