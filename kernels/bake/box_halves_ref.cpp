// SPDX-License-Identifier: Apache-2.0
// box_halves_ref.cpp - the specification of box_halves.cpp.
#include <algorithm>

#include "kernels/bake/box_halves.h"

namespace h6::kernels {
namespace {

std::int64_t squared_diagonal(const ShortBox* boxes, const std::uint16_t* some, std::size_t count) {
  std::int64_t sum = 0;
  for (std::size_t k = 0; k < 3 && count > 0; ++k) {
    int low = boxes[some[0]].least[k], high = -boxes[some[0]].least[4 + k];
    for (std::size_t i = 1; i < count; ++i) {
      low = std::min<int>(low, boxes[some[i]].least[k]);
      high = std::max<int>(high, -boxes[some[i]].least[4 + k]);
    }
    sum += std::int64_t{high - low} * (high - low);
  }
  return sum;
}

}  // namespace

std::size_t smallest_halves_ref(const ShortBox* boxes, const std::uint16_t* const order[3],
                                std::size_t count, std::size_t half) {
  std::int64_t sum[3];
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] = squared_diagonal(boxes, order[k], half) +
             squared_diagonal(boxes, order[k] + half, count - half);
  return std::size_t(std::min_element(sum, sum + 3) - sum);
}

}  // namespace h6::kernels
