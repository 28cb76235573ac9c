// SPDX-License-Identifier: Apache-2.0
// box_halves.h - chooses how to split a set of boxes into two halves with small bounding boxes: the
// inner loop of building a tree.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

// Lower ends along three axes, then upper ends negated, so that both are joined by a minimum. Ends
// lie within 0 .. 16,000; [3] and [7] are 0.
struct ShortBox {
  static constexpr int kMost = 16000;
  alignas(16) std::int16_t least[8];
};
// `order` lists the same `count` boxes in three orders. Returns the order to split after its first
// `half` boxes: the one with the least sum of squared diagonals of the two bounding boxes, the
// first of equals.
std::size_t smallest_halves(const ShortBox* boxes, const std::uint16_t* const order[3],
                            std::size_t count, std::size_t half);
std::size_t smallest_halves_ref(const ShortBox* boxes, const std::uint16_t* const order[3],
                                std::size_t count, std::size_t half);

}  // namespace h6::kernels
