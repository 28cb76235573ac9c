// SPDX-License-Identifier: Apache-2.0
// chunk.h - a chunk of a dataset as HDF5's shuffle and deflate filters store it. Private.
//
// The recorder writes chunks in this form and a conversion hands them to HDF5 as they are. Reading
// goes through this file too: HDF5 trusts the sizes that a file states and reads past its buffers
// where a damaged file lies. Here a chunk must inflate to exactly the size it should have.
#pragma once
#include <cstddef>
#include <vector>

namespace h6::io::recording {

constexpr unsigned deflate_level = 1;  // higher levels cost three times the time for 3 % less

// Groups byte k of all cells, for every k; the length must be a multiple of `cell` bytes.
void shuffle(const std::vector<std::byte>& from, std::size_t cell, std::vector<std::byte>& to);
void unshuffle(const std::vector<std::byte>& from, std::size_t cell, std::vector<std::byte>& to);

// Appends the compressed bytes to `out` and returns their number.
std::size_t deflate(const std::vector<std::byte>& from, std::vector<std::byte>& out);
// False unless `from` inflates to exactly `to.size()` bytes.
bool inflate(const std::byte* from, std::size_t bytes, std::vector<std::byte>& to);

}  // namespace h6::io::recording
