// SPDX-License-Identifier: Apache-2.0
// missed_halves.h - where interpolated samples miss exact ones, in a box of 9 x 9 x 9 nodes.
#pragma once
#include <cstddef>

namespace h6::kernels {

inline constexpr std::size_t kMissedBox = 729, kMissedBoxRoom = 736;

// `corners`: (cells + 1)^3 nodes, x fastest; `cells`, 2 or 4, fill the box. `exact`: (9^3), with
// room for kMissedBoxRoom. Bit i + 2j + 4k of the result: half (i, j, k) of the box along each
// axis, faces included, has a node where the trilinear interpolation of the corners differs from
// `exact` by more than `allowed`, while |exact| < tested. An unknown exact value (NaN) misses
// nothing; an unknown corner makes all nodes miss that it is a part of. Every target has the same
// bits.
unsigned missed_halves(const float* corners, std::size_t cells, const float* exact, float allowed,
                       float tested);
unsigned missed_halves_ref(const float* corners, std::size_t cells, const float* exact,
                           float allowed, float tested);

}  // namespace h6::kernels
