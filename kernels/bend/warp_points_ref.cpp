// SPDX-License-Identifier: Apache-2.0
// warp_points_ref.cpp - the specification of the functions of warp_points.h.
#include <algorithm>
#include <cmath>

#include "hapsix/vector.h"
#include "kernels/bend/mean_rotation.h"
#include "kernels/bend/warp_points.h"

namespace h6::kernels {
namespace {

template <class F>
void each_row(const std::uint32_t* vectors, std::size_t n, const F& f) {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t lane = 0; lane < kBendLanes; ++lane) f(vectors ? vectors[k] : k, lane);
}

// One row's value of one mode.
float mode_at(const ModesView& m, std::size_t axes, std::size_t v, std::size_t j, std::size_t axis,
              std::size_t lane) {
  return m.modes[((v * m.count + j) * axes + axis) * kBendLanes + lane];
}

// sum_j q_j modes[v][j][axis][lane], or sum_j |q_j| ...
double carried(const ModesView& m, std::size_t axes, const float* q, std::size_t v,
               std::size_t axis, std::size_t lane, bool absolute = false) {
  double sum = 0;
  for (std::size_t j = 0; j < m.count; ++j)
    sum += double{absolute ? std::fabs(q[j]) : q[j]} * double{mode_at(m, axes, v, j, axis, lane)};
  return sum;
}
h6Vec3 carried_vector(const ModesView& m, std::size_t axes, const float* q, std::size_t v,
                      std::size_t axis, std::size_t lane) {
  return {carried(m, axes, q, v, axis, lane), carried(m, axes, q, v, axis + 1, lane),
          carried(m, axes, q, v, axis + 2, lane)};
}

h6Vec3 load(const float* const from[3], std::size_t i) {
  return {double{from[0][i]}, double{from[1][i]}, double{from[2][i]}};
}
void store(const h6Vec3& value, float* const to[3], std::size_t i) {
  to[0][i] = static_cast<float>(value.x);
  to[1][i] = static_cast<float>(value.y);
  to[2][i] = static_cast<float>(value.z);
}

h6Vec3 warped(const h6Vec3& u, const h6Vec3& w) {
  const MeanRotation m = mean_rotation(dot(w, w));
  return m.a[0] * u + m.b[0] * cross(w, u) + (m.c[0] * dot(w, u)) * w;
}

}  // namespace

void warp_points_ref(const ModesView& modes, const float* q, const float* const rest[3],
                     const std::uint32_t* vectors, std::size_t n, float* const to[9]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    const h6Vec3 u = carried_vector(modes, 6, q, v, 0, lane);
    const h6Vec3 w = carried_vector(modes, 6, q, v, 3, lane);
    store(load(rest, i) + warped(u, w), to, i);
    store(u, to + 3, i);
    store(w, to + 6, i);
  });
}

void warp_normals_ref(const float* const rest[3], const float* const turn[3],
                      const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    const h6Vec3 normal = load(rest, i), w = load(turn, i);
    const double s = dot(w, w);
    const MeanRotation m = mean_rotation(s);
    store((1 - m.b[0] * s) * normal + m.a[0] * cross(w, normal) + (m.b[0] * dot(w, normal)) * w, to,
          i);
  });
}

void warp_spheres_ref(const ModesView& modes, const float* q, const float* const rest[4],
                      const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  each_row(vectors, n, [&](std::size_t v, std::size_t lane) {
    const std::size_t i = v * kBendLanes + lane;
    const h6Vec3 u = carried_vector(modes, 8, q, v, 0, lane);
    const h6Vec3 w = carried_vector(modes, 8, q, v, 3, lane);
    const double a = carried(modes, 8, q, v, 6, lane, true);
    const double b = carried(modes, 8, q, v, 7, lane, true);
    const double radius = double{rest[3][i]}, most = norm(u) + a + norm(w) * radius;
    store(load(rest, i) + warped(u, w), to, i);
    to[3][i] = static_cast<float>((radius + a + (0.5 * b + double{kWarpRounding}) * most) *
                                  double{kRoundUp});
  });
}

WarpReach warp_reach_ref(const ModesView& modes, const float* q, const float* radius,
                         std::size_t n) {
  double shift = 0, turn = 0;
  each_row(nullptr, n, [&](std::size_t v, std::size_t lane) {
    const double w = norm(carried_vector(modes, 8, q, v, 3, lane));
    shift = std::max(shift, norm(carried_vector(modes, 8, q, v, 0, lane)) +
                                carried(modes, 8, q, v, 6, lane, true) +
                                w * double{radius[v * kBendLanes + lane]});
    turn = std::max(turn, w + carried(modes, 8, q, v, 7, lane, true));
  });
  return {static_cast<float>(shift) * kRoundUp, static_cast<float>(turn) * kRoundUp};
}

void warp_rows_ref(const BentContacts& c, const ModesView& modes, const float* const at[6],
                   const float turn[9], std::size_t stride, float* out) {
  for (std::size_t i = 0; i < c.count; ++i) {
    float* const row = out + i * stride;
    float local[3];
    rigid_row(c, i, turn, row, local);
    const std::size_t v = c.row[i] / kBendLanes, lane = c.row[i] % kBendLanes;
    const h6Vec3 d{double{local[0]}, double{local[1]}, double{local[2]}};
    const h6Vec3 u = load(at, c.row[i]), w = load(at + 3, c.row[i]), cu = cross(u, d);
    const MeanRotation m = mean_rotation(dot(w, w));
    // d.R~(w) u and its derivatives by u and by w.
    const h6Vec3 by_u = m.a[0] * d + m.b[0] * cross(d, w) + (m.c[0] * dot(d, w)) * w;
    const double along =
        2 * (m.a[1] * dot(u, d) + m.b[1] * dot(w, cu) + m.c[1] * dot(w, u) * dot(w, d));
    const h6Vec3 by_w = along * w + m.b[0] * cu + m.c[0] * (dot(w, d) * u + dot(w, u) * d);
    for (std::size_t j = 0; j < modes.count; ++j) {
      const auto mode = [&](std::size_t axis) {
        return double{mode_at(modes, 6, v, j, axis, lane)};
      };
      row[6 + j] = static_cast<float>(dot(by_u, h6Vec3{mode(0), mode(1), mode(2)}) +
                                      dot(by_w, h6Vec3{mode(3), mode(4), mode(5)}));
    }
    std::fill(row + 6 + modes.count, row + stride, 0.0f);
  }
}

}  // namespace h6::kernels
