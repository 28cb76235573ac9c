// SPDX-License-Identifier: Apache-2.0
// bend_points_ref.cpp - the specification of the functions of bend_points.h.
#include <algorithm>
#include <cmath>

#include "kernels/bend/bend_points.h"

namespace h6::kernels {
namespace {

// sum_j q_j modes[v][j][axis][lane]
float carried(const ModesView& m, int axes, const float* q, std::size_t v, int axis,
              std::size_t lane) {
  float sum = 0;
  for (std::size_t j = 0; j < m.count; ++j) {
    const std::size_t at = (v * m.count + j) * static_cast<std::size_t>(axes);
    sum += q[j] * m.modes[(at + static_cast<std::size_t>(axis)) * kBendLanes + lane];
  }
  return sum;
}

float spread(const ModesView& m, const float* q, std::size_t v, std::size_t lane) {
  float sum = 0;
  for (std::size_t j = 0; j < m.count; ++j)
    sum += std::fabs(q[j]) * m.modes[((v * m.count + j) * 4 + 3) * kBendLanes + lane];
  return sum;
}

template <class F>
void each_row(const std::uint32_t* vectors, std::size_t n, const F& f) {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t lane = 0; lane < kBendLanes; ++lane) f(vectors ? vectors[k] : k, lane);
}

}  // namespace

void bend_points_ref(const ModesView& modes, const float* q, const float* const rest[3],
                     const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    for (int axis = 0; axis < 3; ++axis)
      to[axis][i] = rest[axis][i] + carried(modes, 3, q, v, axis, lane);
  });
}

void bend_normals_ref(const ModesView& modes, const float* q, const float* const rest[3],
                      const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    float p[3];
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = rest[axis][i] + carried(modes, 3, q, v, axis, lane);
    const float length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (int axis = 0; axis < 3; ++axis)
      to[axis][i] = length > 1e-6f ? p[axis] / length : rest[axis][i];
  });
}

void bend_spheres_ref(const ModesView& modes, const float* q, const float* const rest[4],
                      const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    for (int axis = 0; axis < 3; ++axis)
      to[axis][i] = rest[axis][i] + carried(modes, 4, q, v, axis, lane);
    to[3][i] = (rest[3][i] + spread(modes, q, v, lane)) * kRoundUp;
  });
}

float bend_reach_ref(const ModesView& modes, const float* q, std::size_t n) {
  float most = 0;
  each_row(nullptr, n, [&](std::size_t v, std::size_t lane) {
    float squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float way = carried(modes, 4, q, v, axis, lane);
      squares += way * way;
    }
    most = std::max(most, (std::sqrt(squares) + spread(modes, q, v, lane)) * kRoundUp);
  });
  return most;
}

void contact_rows_ref(const BentContacts& c, const ModesView& modes, const float turn[9],
                      std::size_t stride, float* out) {
  for (std::size_t i = 0; i < c.count; ++i) {
    float* const row = out + i * stride;
    float local[3];
    rigid_row(c, i, turn, row, local);
    const std::size_t v = c.row[i] / kBendLanes, lane = c.row[i] % kBendLanes;
    for (std::size_t j = 0; j < modes.count; ++j) {
      const float* const mode = modes.modes + (v * modes.count + j) * 3 * kBendLanes + lane;
      row[6 + j] =
          local[0] * mode[0] + local[1] * mode[kBendLanes] + local[2] * mode[2 * kBendLanes];
    }
    std::fill(row + 6 + modes.count, row + stride, 0.0f);
  }
}

}  // namespace h6::kernels
