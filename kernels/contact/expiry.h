// SPDX-License-Identifier: Apache-2.0
// expiry.h - blocks of 16 values that are each good until something has passed them.
//
// Traversal keeps, for every group of points, how far the shell may travel before that group can
// touch: its expiry. Few groups expire in a frame; these find them.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;

// Appends to `out`, in order, every index 16 b + i with values[16 b + i] <= now, for the blocks
// b = blocks[0..count-1] (or 0..count-1 when blocks is null). Room for 16 count. Returns how many.
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
