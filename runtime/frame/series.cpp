// SPDX-License-Identifier: Apache-2.0
// series.cpp - the rule `series` in a frame: loads of all contacts of a shell body from one solve,
// then wrenches and derivatives pair by pair. METHOD.md, Sec. 3.
//
// With C_p = sum kappa J J^T and B_p = sum kappa J J_g^T over the loaded contacts of pair p (J
// about a's centre of mass, unscaled), G = c S^-2 and A = G + sum_p C_p, relative motion q of pair
// q gives
//     d f_p / d q = -k (delta_pq B_p - C_p A^-1 B_q),     summed over p: -k G A^-1 B_q
// and each block of the system follows as in sum_wrench.cpp, S_p carrying wrenches to b_p. In
// symmetric form B_p = C_p.
#include <Eigen/LU>
#include <algorithm>

#include "runtime/frame/stages.h"
#include "runtime/frame/weighing.h"

namespace h6 {

void fill_series_gap(Contacts& c, double beta, const Vec6& u, std::size_t begin, std::size_t end) {
  kernels::series_gap(kernel_columns(c, begin, end), c.depth + begin, beta, u.data(),
                      c.load + begin);
}

kernels::SeriesResult solve_series(Contacts& c, const h6ContactDef& def, double lever,
                                   double y[6]) {
  fill_facing(c, true);
  const kernels::SeriesColumns columns{c.nx, c.ny,   c.nz,     c.rx,   c.ry,
                                       c.rz, c.load, c.facing, c.count};
  const kernels::SeriesResult result =
      kernels::series_solve(columns, {def.series_c, lever}, y, c.kappa, c.slack);
  kernels::series_loads(c.kappa, c.slack, c.depth, c.count, c.load, c.weight);
  return result;
}

kernels::WrenchSum sum_series_rows(const Contacts& c, bool exact, std::size_t begin,
                                   std::size_t end) {
  const kernels::WrenchColumns columns{c.slack, c.kappa, c.nx, c.ny, c.nz, c.gx,
                                       c.gy,    c.gz,    c.rx, c.ry, c.rz, c.count};
  return kernels::contact_wrench(columns, {1.0, 0.0, {}, exact}, begin, end);
}

Mat6 series_spring(const h6ContactDef& def, double lever) {
  Mat6 G = def.series_c * Mat6::Identity();
  G.bottomRightCorner<3, 3>() *= lever * lever;
  return G;
}

void weigh_series(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  Body& body = s.bodies[s.pairs[first_pair].a];
  Contacts& c = s.contacts[s.pairs[first_pair].a];
  for (std::size_t p = first_pair; p < end_pair; ++p)
    fill_series_gap(c, s.contact.damping, pair_velocity(s, s.pairs[p]), s.pairs[p].begin,
                    s.pairs[p].end);
  const kernels::SeriesResult result =
      solve_series(c, s.contact, series_lever(body.radius, body.voxel), body.series_y);
  s.report.series_iterations =
      std::max(s.report.series_iterations, static_cast<std::uint32_t>(result.iterations));
  s.report.series_residual = std::max(s.report.series_residual, result.residual);
}

void spread_series(h6Session& s, Pair& pair, const kernels::WrenchSum& sum) {
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Vec6 f = s.contact.stiffness * Vec6::Map(sum.force);
  pair.f = f;
  pair.right = row_major(sum.stiffness);  // B_p and C_p, until A is known
  pair.right_d = row_major(sum.damping);
  pair.Kab.setZero(), pair.Kba.setZero();
  if (s.gradient == H6_EXACT) add_geometric_terms(s, pair, f);
  if (!a.fixed) a.f += f;
  if (!b.fixed) b.f -= arm_shift(s, pair) * f;
}

void join_series(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  Body& a = s.bodies[s.pairs[first_pair].a];
  const double k = s.contact.stiffness, beta = s.contact.damping;
  const Mat6 G = series_spring(s.contact, series_lever(a.radius, a.voxel));
  Mat6 B = Mat6::Zero(), C = Mat6::Zero();
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    B += s.pairs[p].right;
    C += s.pairs[p].right_d;
  }
  const Mat6 inverse = (G + C).inverse();
  if (!a.fixed) {
    a.K -= k * G * inverse * B;
    a.D -= k * beta * G * inverse * C;
  }
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    Body& b = s.bodies[pair.b];
    pair.B = k * (pair.right_d - pair.right_d * inverse * C);
    pair.Dab.setZero(), pair.Dba.setZero();
    if (b.fixed) continue;
    const Mat6 S = arm_shift(s, pair), Bp = pair.right, Cp = pair.right_d;
    pair.left = k * S * Cp * inverse;
    pair.right = Bp * S.transpose();
    pair.right_d = Cp * S.transpose();
    b.K -= (k * S * Bp - pair.left * Bp) * S.transpose();
    b.D -= beta * (k * S * Cp - pair.left * Cp) * S.transpose();
    if (a.fixed) continue;
    pair.Kab += k * G * inverse * pair.right;
    pair.Kba += k * S * Bp - pair.left * B;
    pair.Dab = k * beta * G * inverse * pair.right_d;
    pair.Dba = beta * (k * S * Cp - pair.left * C);
  }
}

void sum_series(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    spread_series(
        s, pair, sum_series_rows(s.contacts[pair.a], s.gradient == H6_EXACT, pair.begin, pair.end));
  }
  join_series(s, first_pair, end_pair);
}

}  // namespace h6
