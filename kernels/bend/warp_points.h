// SPDX-License-Identifier: Apache-2.0
// warp_points.h - bend_points.h for a shell whose displacements are warped: each point's linear
// displacement u is turned by the mean of the rotations on its way to the turn w (mean_rotation.h).
// METHOD.md, Sec. 10; Choi & Ko 2005.
//
// Modes have six axes for points, u and w, and eight for spheres:
//     modes[((v count + j) axes + axis) 16 + lane]
// Axes of a sphere about c: U_j and W_j, the middles of what its points c + d_i do in mode j; the
// largest |u_ij - U_j - W_j x d_i|; and the largest |w_ij - W_j|.
#pragma once
#include "kernels/bend/bend_points.h"

namespace h6::kernels {

// For the vectors v = vectors[0..n-1] (0..n-1 where null) and all 16 lanes i of each:
//     u = sum_j q_j u_ij, w = sum_j q_j w_ij
//     to[0..2] = rest + R~(w) u, to[3..5] = u, to[6..8] = w
void warp_points(const ModesView& modes, const float* q, const float* const rest[3],
                 const std::uint32_t* vectors, std::size_t n, float* const to[9]);
void warp_points_ref(const ModesView& modes, const float* q, const float* const rest[3],
                     const std::uint32_t* vectors, std::size_t n, float* const to[9]);
// Turns the normals: to = exp([w]x) rest.
void warp_normals(const float* const rest[3], const float* const turn[3],
                  const std::uint32_t* vectors, std::size_t n, float* const to[3]);
void warp_normals_ref(const float* const rest[3], const float* const turn[3],
                      const std::uint32_t* vectors, std::size_t n, float* const to[3]);
// Spheres: rest[3] are radii R that hold the points at rest. With u, w and the spreads a, b summed
// over |q_j|, m = |u| + a + |w| R bounds how far u carries any of the points, and
//     to[0..2] = rest + R~(w) u,   to[3] = (R + a + (b/2 + kWarpRounding) m) kRoundUp
// holds them: the point c + d + R~(w_i) u_i has, from there, d + R~(w) (w x d), which is d turned,
// and R~(w) (u_i - u - w x d), at most a long since R~ is a mean of rotations, and
// (R~(w_i) - R~(w)) u_i, at most b/2 m, since R~ changes by at most half as much as w.
inline constexpr float kWarpRounding = 2e-6f;  // of sums and of R~ in float
void warp_spheres(const ModesView& modes, const float* q, const float* const rest[4],
                  const std::uint32_t* vectors, std::size_t n, float* const to[4]);
void warp_spheres_ref(const ModesView& modes, const float* q, const float* const rest[4],
                      const std::uint32_t* vectors, std::size_t n, float* const to[4]);
// How far q carries (u) and turns (w) any point of the spheres of the vectors 0..n-1, at most: the
// largest m and |w| + b of them, times kRoundUp.
struct WarpReach {
  float shift, turn;
};
WarpReach warp_reach(const ModesView& modes, const float* q, const float* radius, std::size_t n);
WarpReach warp_reach_ref(const ModesView& modes, const float* q, const float* radius,
                         std::size_t n);
// contact_rows with the derivatives of warped points, dp/dq_j = R~ u_j + (dR~/dw w_j) u.
// at: u and w of the shell's rows, as warp_points wrote them.
void warp_rows(const BentContacts& contacts, const ModesView& modes, const float* const at[6],
               const float turn[9], std::size_t stride, float* out);
void warp_rows_ref(const BentContacts& contacts, const ModesView& modes, const float* const at[6],
                   const float turn[9], std::size_t stride, float* out);

}  // namespace h6::kernels
