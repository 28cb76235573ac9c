// SPDX-License-Identifier: Apache-2.0
// box_halves.h - which way to halve boxes so that the boxes around the halves are small: the inner
// loop of making a tree of them.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

// From where along three axes, and minus to where: both are minima. Within 0 to 16,000; [3] and [7]
// are 0.
struct ShortBox {
  static constexpr int kMost = 16000;
  alignas(16) std::int16_t least[8];
};
// `order` names the same `count` boxes three times. Which of the orders to halve, `half` boxes and
// the others: the boxes around both have the least sum of squared diagonals, of equals the first.
std::size_t smallest_halves(const ShortBox* boxes, const std::uint16_t* const order[3],
                            std::size_t count, std::size_t half);
std::size_t smallest_halves_ref(const ShortBox* boxes, const std::uint16_t* const order[3],
                                std::size_t count, std::size_t half);

}  // namespace h6::kernels
