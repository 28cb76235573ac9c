// SPDX-License-Identifier: Apache-2.0
// bend_points.h - moves points, normals and spheres of a shell by its modes, and turns contacts
// into rows of the bent body's Jacobian. METHOD.md, Sec. 10.
//
// Modes stand vector by vector: 16 rows of a shell, or 16 spheres of a tier, in lanes:
//     modes[((v count + j) axes + axis) 16 + lane]
// with 3 axes for points and normals. Spheres have a fourth: how far a mode carries the points of
// the sphere away from its centre, at most.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kBendLanes = 16;
inline constexpr std::size_t kMostModes = 64;

struct ModesView {
  const float* modes;
  std::size_t count;  // r, at most kMostModes
};

// For the vectors v = vectors[0..n-1] (0..n-1 where null) and all 16 lanes i of each:
//     to[axis][16 v + i] = rest[axis][16 v + i] + sum_j q_j modes[v][j][axis][i]
void bend_points(const ModesView& modes, const float* q, const float* const rest[3],
                 const std::uint32_t* vectors, std::size_t n, float* const to[3]);
void bend_points_ref(const ModesView& modes, const float* q, const float* const rest[3],
                     const std::uint32_t* vectors, std::size_t n, float* const to[3]);
// The same, made unit. A vector shorter than 1e-6 keeps its rest.
void bend_normals(const ModesView& modes, const float* q, const float* const rest[3],
                  const std::uint32_t* vectors, std::size_t n, float* const to[3]);
void bend_normals_ref(const ModesView& modes, const float* q, const float* const rest[3],
                      const std::uint32_t* vectors, std::size_t n, float* const to[3]);
// Spheres: rest[3] are radii, and to[3] = (rest[3] + sum_j |q_j| modes[v][j][3][i]) kRoundUp.
// Barbic & James 2004: a sphere that held its points at rest holds them so at any q.
inline constexpr float kRoundUp = 1.00002f;
void bend_spheres(const ModesView& modes, const float* q, const float* const rest[4],
                  const std::uint32_t* vectors, std::size_t n, float* const to[4]);
void bend_spheres_ref(const ModesView& modes, const float* q, const float* const rest[4],
                      const std::uint32_t* vectors, std::size_t n, float* const to[4]);
// How far q carries any point of the spheres of the vectors 0..n-1, at most: the largest
// |sum_j q_j modes[v][j][0..2][i]| + sum_j |q_j| modes[v][j][3][i], times kRoundUp.
float bend_reach(const ModesView& modes, const float* q, std::size_t n);
float bend_reach_ref(const ModesView& modes, const float* q, std::size_t n);

// A force along d at a contact's point, as a row of the Jacobian transposed:
//     out[i stride ..] = d, r x d, then (turn d).modes of the point for each mode, then zeros
// `row`: of the shell, those of one vector next to each other and different. turn: world axes to
// those of the modes, row-major. stride >= 6 + count.
struct BentContacts {
  const float *dx, *dy, *dz, *rx, *ry, *rz;
  const std::uint32_t* row;
  std::size_t count;
};
// The rigid part of contact i's row, and its direction in the axes of the modes.
inline void rigid_row(const BentContacts& c, std::size_t i, const float turn[9], float* row,
                      float local[3]) {
  const float d[3] = {c.dx[i], c.dy[i], c.dz[i]}, r[3] = {c.rx[i], c.ry[i], c.rz[i]};
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    row[k] = d[k];
    row[3 + k] = r[l] * d[m] - r[m] * d[l];
    local[k] = turn[3 * k] * d[0] + turn[3 * k + 1] * d[1] + turn[3 * k + 2] * d[2];
  }
}
void contact_rows(const BentContacts& contacts, const ModesView& modes, const float turn[9],
                  std::size_t stride, float* out);
void contact_rows_ref(const BentContacts& contacts, const ModesView& modes, const float turn[9],
                      std::size_t stride, float* out);

}  // namespace h6::kernels
