// SPDX-License-Identifier: Apache-2.0
// box.h - the nodes of a brick and of its far faces, and values between nodes.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "io/field/field_data.h"

namespace h6::io {

// Numbers of a node, a cell or a brick.
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

// The row of brick `at`; -1 where there is none.
inline std::int32_t row_of(const FieldData& field, const GridNode& at) {
  for (std::size_t k = 0; k < 3; ++k)
    if (at[k] < 0 || at[k] >= field.bricks[k]) return -1;
  return field.brick_index[place_in(at, field.bricks)];
}

inline constexpr int kBoxSide = 9, kBox = kBoxSide * kBoxSide * kBoxSide;
inline constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// The nodes of brick `at` and of its far faces; kUnknown where they lie in no brick. Returns false
// where the brick itself has no samples.
inline bool read_box(const FieldData& field, const GridNode& at, float* out) {
  const float* source[8];
  for (int k = 0; k < 8; ++k) {
    const std::int32_t row =
        row_of(field, {at[0] + (k & 1), at[1] + (k >> 1 & 1), at[2] + (k >> 2)});
    source[k] = row < 0 ? nullptr : &field.samples[std::size_t(row) * 512];
    if (source[0] == nullptr) return false;
  }
  static constexpr std::array<float, 512> kNone = [] {
    std::array<float, 512> none{};
    none.fill(kUnknown);
    return none;
  }();
  for (const float*& s : source)
    if (s == nullptr) s = kNone.data();
  float* to = out;
  for (int z = 0; z < kBoxSide; ++z)
    for (int y = 0; y < kBoxSide; ++y, to += kBoxSide) {
      const int from = (y >> 3) << 1 | (z >> 3) << 2, first = ((z & 7) * 8 + (y & 7)) * 8;
      std::copy_n(source[from] + first, 8, to);
      to[8] = source[from | 1][first];
    }
  return true;
}

// `count` arrays of `width` values, and step - 1 others evenly between each two of them.
template <int count, int step, int width>
void spread(const float* from, float* out) {
  for (int i = 0; i <= (count - 1) * step; ++i) {
    const float* const low = from + i / step * width;
    float* const to = out + i * width;
    const float t = float(i % step) / step;
    if (i % step == 0)
      std::copy_n(low, width, to);
    else
      for (int n = 0; n < width; ++n) to[n] = low[n] + t * (low[width + n] - low[n]);
  }
}

// Trilinear values between `count` nodes a side, `step` to a cell. Boxes that share a face, an edge
// or a corner have the same bits there: its values come from its own nodes alone, so an unknown
// node beside it does not matter either.
template <int count, int step, int side = (count - 1) * step + 1>
void interpolate(const float (&nodes)[count * count * count], float (&out)[side * side * side]) {
  float lines[count * count * side], planes[count * side * side];
  for (int row = 0; row < count * count; ++row)
    spread<count, step, 1>(nodes + count * row, lines + side * row);
  for (int z = 0; z < count; ++z)
    spread<count, step, side>(lines + count * side * z, planes + side * side * z);
  spread<count, step, side * side>(planes, out);
}

}  // namespace h6::io
