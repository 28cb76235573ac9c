// SPDX-License-Identifier: Apache-2.0
// sample_field_ref.cpp - the specification of sample_field, one point at a time.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "kernels/field/sample_field.h"

namespace h6::kernels {
namespace {

// A direction component or gradient of squares below this counts as 0.
constexpr float kLeastSlope = 1e-6f, kLeastSlope2 = 1e-12f;

struct Sample {
  float value;
  float gradient[3];
};

// Trilinear value of 8 corners (x fastest) at t in [0,1]^3, and its derivative by t.
Sample trilinear(const float corner[8], const float t[3]) {
  Sample s{};
  for (int k = 0; k < 8; ++k) {
    float weight[3], slope[3];
    for (int axis = 0; axis < 3; ++axis) {
      const bool high = (k >> axis & 1) != 0;
      weight[axis] = high ? t[axis] : 1.0f - t[axis];
      slope[axis] = high ? 1.0f : -1.0f;
    }
    s.value += corner[k] * weight[0] * weight[1] * weight[2];
    s.gradient[0] += corner[k] * slope[0] * weight[1] * weight[2];
    s.gradient[1] += corner[k] * weight[0] * slope[1] * weight[2];
    s.gradient[2] += corner[k] * weight[0] * weight[1] * slope[2];
  }
  return s;
}

Sample sample_near(const std::int16_t* brick, const std::int32_t cell[3], const float t[3]) {
  float corner[8];
  for (int k = 0; k < 8; ++k) {
    const int x = cell[0] + (k & 1), y = cell[1] + (k >> 1 & 1), z = cell[2] + (k >> 2);
    corner[k] = kNearQuantum * brick[(z * 9 + y) * 9 + x];
  }
  return trilinear(corner, t);
}

// The nodes of a cell cut into 2 or 4; null where the cell keeps the samples of its brick.
const std::int16_t* finer_nodes(const FieldView& field, std::int32_t row,
                                const std::int32_t cell[3], int& factor) {
  const std::uint16_t* codes = field.cuts + std::ptrdiff_t{kCutStride} * row;
  const std::uint16_t code = codes[kCutHead + (cell[2] * 8 + cell[1]) * 8 + cell[0]];
  if (code == 0) return nullptr;
  std::int32_t first;
  std::memcpy(&first, codes, sizeof first);
  factor = (code & 1) != 0 ? 4 : 2;
  return field.fine + std::ptrdiff_t{kFineUnit} * (first + (code >> 1));
}

Sample sample_finer(const std::int16_t* nodes, int factor, const float t[3]) {
  const int side = factor + 1;
  std::int32_t low[3];
  float s[3], corner[8];
  for (int axis = 0; axis < 3; ++axis) {
    const float scaled = t[axis] * static_cast<float>(factor);
    low[axis] = std::min(static_cast<std::int32_t>(scaled), factor - 1);
    s[axis] = scaled - static_cast<float>(low[axis]);
  }
  for (int k = 0; k < 8; ++k) {
    const int x = low[0] + (k & 1), y = low[1] + (k >> 1 & 1), z = low[2] + (k >> 2);
    corner[k] = kNearQuantum * nodes[(z * side + y) * side + x];  // fine voxels
  }
  Sample found = trilinear(corner, s);
  found.value /= static_cast<float>(factor);  // voxels; the slope is the same
  return found;
}

// J of views.h, from the squares at the corners and their trilinear value.
float far_bound(float whole, float floor, const float u[3]) {
  float sag = 0;
  for (int axis = 0; axis < 3; ++axis) sag += 64 * (u[axis] * (1 - u[axis]));
  return std::sqrt(std::max(whole - sag, std::min(whole, floor * floor)));
}

// J where the gradient of the squares leaves the cell, less the way there [voxel].
float bound_from_farther(const float square[8], const Sample& whole, float band, const float u[3]) {
  float length2 = 0;
  for (float slope : whole.gradient) length2 += slope * slope;
  const float inverse = 1 / std::sqrt(std::max(length2, kLeastSlope2));
  float n[3], way = std::numeric_limits<float>::max();  // in cells
  for (int axis = 0; axis < 3; ++axis) {
    n[axis] = whole.gradient[axis] * inverse;
    const float room = n[axis] > 0 ? 1 - u[axis] : u[axis];
    way = std::min(way, room / std::max(std::fabs(n[axis]), kLeastSlope));
  }
  float there[3];
  for (int axis = 0; axis < 3; ++axis) there[axis] = u[axis] + way * n[axis];
  return far_bound(trilinear(square, there).value, band, there) - 8 * way;
}

Sample sample_far(const std::int16_t* far, float band, const std::int32_t cell[3],
                  const float t[3]) {
  float corner[8], square[8], u[3];
  for (int k = 0; k < 8; ++k) {
    corner[k] = kFarQuantum * far[k];
    square[k] = corner[k] * corner[k];
  }
  for (int axis = 0; axis < 3; ++axis) u[axis] = (cell[axis] + t[axis]) / 8;
  Sample s = trilinear(corner, u);
  for (float& slope : s.gradient) slope /= 8;  // per voxel
  const Sample whole = trilinear(square, u);
  float end = 8;  // of the cell, from here
  for (float t : u) end = std::min(end, 8 * std::min(t, 1 - t));
  float bound = far_bound(whole.value, band + end, u);
  if (whole.value < kAskFarther * kAskFarther)
    bound = std::max(bound, bound_from_farther(square, whole, band, u));
  s.value = std::copysign(bound, s.value);
  return s;
}

Sample sample_inside(const FieldView& field, const float q[3]) {
  std::int32_t brick[3], cell[3];
  float t[3];
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t unit =
        std::min(static_cast<std::int32_t>(q[axis]), 8 * field.size[axis] - 2);
    brick[axis] = unit / 8;
    cell[axis] = unit % 8;
    t[axis] = q[axis] - static_cast<float>(unit);
  }
  const std::int32_t slot = (brick[2] * field.size[1] + brick[1]) * field.size[0] + brick[0];
  const std::int32_t entry = field.table[slot];
  if (entry < 0)
    return sample_far(field.far + 8 * (std::ptrdiff_t{-1} - entry), field.band, cell, t);
  const std::int32_t row = row_of(entry);
  if (entry != row) {
    int factor = 1;
    if (const std::int16_t* nodes = finer_nodes(field, row, cell, factor))
      return sample_finer(nodes, factor, t);
  }
  return sample_near(field.bricks + std::ptrdiff_t{kBrickStride} * row, cell, t);
}

Sample sample_anywhere(const FieldView& field, const float p[3]) {
  if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
    return {std::numeric_limits<float>::infinity(), {0, 0, 0}};
  }
  float q[3], off[3], off2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    q[axis] = std::clamp(p[axis], 0.0f, static_cast<float>(8 * field.size[axis] - 1));
    off[axis] = p[axis] - q[axis];
    off2 += off[axis] * off[axis];
  }
  Sample s = sample_inside(field, q);
  if (!(off2 > 0)) return s;
  // Outside: d = sqrt(off^2 + value^2). An obstacle inside the grid, which is convex, is at least
  // that far when it is `value` away from the grid's nearest point.
  const float value = std::max(s.value, 0.0f);
  const float distance = std::sqrt(off2 + value * value);
  for (int axis = 0; axis < 3; ++axis) {
    // The nearest grid point moves along the axes that were not clamped.
    const float slope = off[axis] != 0 ? off[axis] : value * s.gradient[axis];
    s.gradient[axis] = slope / distance;
  }
  s.value = distance;
  return s;
}

}  // namespace

void sample_field_ref(const FieldView& field, const Affine& to_field, const PointsView& points,
                      const std::uint32_t* rows, std::size_t count, float* distance, float* gx,
                      float* gy, float* gz) {
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t row = rows != nullptr ? rows[k] : k;
    float q[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float* m = to_field.m[axis];
      q[axis] = m[0] * points.x[row] + (m[1] * points.y[row] + (m[2] * points.z[row] + m[3]));
    }
    const Sample s = sample_anywhere(field, q);
    distance[k] = s.value;
    if (gx == nullptr) continue;
    gx[k] = s.gradient[0];
    gy[k] = s.gradient[1];
    gz[k] = s.gradient[2];
  }
}

}  // namespace h6::kernels
