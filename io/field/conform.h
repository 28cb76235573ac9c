// SPDX-License-Identifier: Apache-2.0
// conform.h - makes the finer samples of cells continuous with the coarser ones beside them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "io/field/field_data.h"

namespace h6::io {

// Numbers of a node in the fine grid, of four nodes a voxel; or of a cell or brick.
using GridNode = std::array<int, 3>;

// Element n of an array of this size, x fastest; and back.
inline std::size_t place_in(const GridNode& n, const std::array<std::int32_t, 3>& size) {
  return (std::size_t(n[2]) * std::size_t(size[1]) + std::size_t(n[1])) * std::size_t(size[0]) +
         std::size_t(n[0]);
}
inline GridNode place_of(std::size_t i, const std::array<std::int32_t, 3>& size) {
  const std::size_t x = std::size_t(size[0]), y = std::size_t(size[1]);
  return {int(i % x), int(i / x % y), int(i / x / y)};
}

// The coarse sample at a fine node whose numbers are multiples of 4; null where there is no brick.
const float* coarse_node(const FieldData& field, const GridNode& node);

// In field.halves and field.quarters, a node on a face, edge or corner towards a coarser cell takes
// that cell's interpolation.
void conform(unsigned threads, FieldData& field);

}  // namespace h6::io
