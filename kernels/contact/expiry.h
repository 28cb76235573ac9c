// SPDX-License-Identifier: Apache-2.0
// expiry.h - finds the values that have expired, in blocks of 16.
//
// Traversal keeps an expiry for every group of points: the way that the shell may travel before the
// group can touch. Few groups expire in a frame.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;

// Writes to `out`, in order, every index 16 b + i with values[16 b + i] <= now, for the blocks
// b = blocks[0..count-1] (or 0..count-1 when blocks is null). `out` has room for 16 count. Returns
// the number of indices.
std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count, float now,
                    std::uint32_t* out);
std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        float now, std::uint32_t* out);

// out[blocks[k]] = the least of the block's 16 values. No NaN.
void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out);
void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out);

}  // namespace h6::kernels
