// SPDX-License-Identifier: Apache-2.0
// series.cpp - the rule `series` in a frame: one solve gives the loads of all contacts of a shell
// body; wrenches and derivatives follow pair by pair. METHOD.md, Sec. 3.
//
// Let C_p = sum kappa J J^T and B_p = sum kappa J J_g^T over the loaded contacts of pair p (J about
// a's centre of mass, unscaled), G = c S^-2 and A = G + sum_p C_p. The relative motion q of pair q
// then gives
//     d f_p / d q = -k (delta_pq B_p - C_p A^-1 B_q),     summed over p: -k G A^-1 B_q
// Each block of the system follows as in sum_wrench.cpp; S_p carries wrenches to b_p. In symmetric
// form B_p = C_p.
#include <algorithm>

#include "runtime/base/solve_positive.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/deformation.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

// The spring's last extension, times this, must cover its next one.
constexpr double kAhead = 2;
// `firm`: the slack over which a contact's stiffness grows to its whole [voxel]. METHOD.md, Sec. 3.
// The voxel is the smallest of all fields that the body may touch, since one solve has one touch: a
// field of coarser voxels beside a fine one gets a shorter touch than it would get alone.
constexpr double kTouch = 0.03;
constexpr std::size_t kLoadSlice = 2048;  // contacts whose loads are filled at a time

kernels::SliceRunner slices_on(sched::FrameTeam* team) {
  if (team == nullptr) return {};
  return {[](void* self, std::size_t slices, kernels::SliceRunner::Work work, void* context) {
            static_cast<sched::FrameTeam*>(self)->run(slices, work, context);
          },
          team};
}

}  // namespace

void look_ahead(const Settings& set, std::span<const Body> bodies, ShellBody& shell) {
  const double most = uses_series(set.contact) ? set.contact.margin_voxels : 0.0;
  const Body& a = bodies[shell.body];
  Eigen::Map<Vec6> y(shell.series_y);
  if (!y.allFinite()) y.setZero();  // after a run that was unstable
  Vec6 spring = kAhead * y;
  spring.tail<3>() /= spring_lever(set.contact, series_lever(a.radius, a.voxel));
  for (Pair& pair : shell.pairs) {
    PairSearch& search = pair.search;
    search.margin = 0;
    if (!(most > 0)) continue;
    const Body& b = bodies[pair.b];
    const Vec6 way = spring + set.contact.damping * pair_velocity(a, b);
    for (int k = 0; k < 6; ++k) search.ahead[k] = static_cast<float>(way[k]);
    const double reach = (way.head<3>().norm() + way.tail<3>().norm() * a.radius) / b.field->voxel;
    // A point loses its relief where it takes no part, so that must not depend on the spring.
    search.margin = static_cast<float>(search.fit.count == 0 && reach < most ? reach : most);
  }
}

void fill_series_gap(Contacts& c, double beta, const Vec6& u, std::size_t begin, std::size_t end) {
  kernels::series_gap(kernel_columns(c, begin, end), c.depth + begin, beta, u.data(),
                      c.load + begin);
}

kernels::SeriesResult solve_series(Contacts& c, const h6ContactDef& def, double voxel, double lever,
                                   double y[6], sched::FrameTeam* team) {
  kernels::SeriesParameters parameters{def.series_c, spring_lever(def, lever)};
  if (def.method == H6_METHOD_FIRM) parameters.touch = kTouch * voxel;
  const kernels::SeriesColumns columns{c.nx, c.ny,   c.nz,     c.rx,   c.ry,
                                       c.rz, c.load, c.weight, c.count};
  const kernels::SeriesResult result =
      kernels::series_solve(columns, parameters, y, c.kappa, c.slack, slices_on(team));
  for_slices((c.count + kLoadSlice - 1) / kLoadSlice, team, [&](std::size_t i) {
    const std::size_t at = i * kLoadSlice;
    kernels::series_loads({c.kappa + at, c.slack + at, c.depth + at, c.load + at, c.weight + at,
                           std::min(kLoadSlice, c.count - at)},
                          static_cast<float>(parameters.touch));
  });
  return result;
}

kernels::WrenchSum sum_series_rows(const Contacts& c, bool exact, std::size_t begin,
                                   std::size_t end) {
  return kernels::contact_wrench(series_columns(c), {1.0, 0.0, {}, exact}, begin, end);
}

Mat6 series_spring(const h6ContactDef& def, double lever) {
  Mat6 G = def.series_c * Mat6::Identity();
  const double turn = spring_lever(def, lever);
  G.bottomRightCorner<3, 3>() *= turn * turn;
  return G;
}

// Fills e, except for a body that bends (fill_bent_gap). Under `firm`, push_firmly comes first. A
// slice does both while its rows are in the cache.
void prepare_rows(const Settings& set, std::span<const Body> bodies, const Pair& pair, Contacts& c,
                  Lane& lane) {
  const Body &a = bodies[pair.a], &b = bodies[pair.b];
  const std::size_t count = pair.end - pair.begin;
  const bool firm = set.contact.method == H6_METHOD_FIRM;
  if (count == 0 || (a.bend && !firm)) return;
  const Vec6 u = pair_velocity(a, b);
  share_slices(lane, lane.pushing, count, (count + kPushedRows - 1) / kPushedRows,
               [&](std::size_t i) {
                 const std::size_t begin = pair.begin + i * kPushedRows;
                 const std::size_t end = std::min(begin + kPushedRows, pair.end);
                 if (firm) push_firmly(set, b, pair, c, begin, end);
                 if (!a.bend) fill_series_gap(c, set.contact.damping, u, begin, end);
               });
}

void weigh_series(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  const Body& a = bodies[shell.body];
  Contacts& c = shell.contacts;
  for (const Pair& pair : shell.pairs) prepare_rows(set, bodies, pair, c, lane);
  sched::FrameTeam* const team = weighing_team(c.count, lane);
  fill_inner_stiffness(c, set.contact, a.voxel, team, lane.scratch->weigh);
  if (a.bend) {
    make_bent_rows(set, bodies, shell);
    fill_bent_gap(set, bodies, shell);
  }
  const kernels::SeriesResult result =
      solve_series(c, set.contact, a.voxel, series_lever(a.radius, a.voxel), shell.series_y, team);
  h6FrameReport& report = lane.report;
  report.series_iterations =
      std::max(report.series_iterations, static_cast<std::uint32_t>(result.iterations));
  report.series_residual = std::max(report.series_residual, result.residual);
}

void spread_series(const Settings& set, const Sides& sides, Pair& pair,
                   const kernels::WrenchSum& sum) {
  const Vec6 f = set.contact.stiffness * Vec6::Map(sum.force);
  pair.f = f;
  if (pair.between) pair.between->Kab.setZero(), pair.between->Kba.setZero();
  if (set.gradient == H6_EXACT) add_geometric_terms(sides, pair, f);
  if (!sides.a.fixed) sides.on_a.f += f;
  if (!sides.b.fixed) sides.on_b.f -= arm_shift(sides.a, sides.b) * f;
}

void join_series(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                 std::span<LinearWrench> acting) {
  const Body& a = bodies[shell.body];
  const double k = set.contact.stiffness, beta = set.contact.damping;
  const Mat6 G = series_spring(set.contact, series_lever(a.radius, a.voxel));
  Mat6 B = Mat6::Zero(), C = Mat6::Zero();
  for (const Pair& pair : shell.pairs) {
    if (pair.begin == pair.end) continue;
    B += row_major(pair.sum.stiffness);
    C += row_major(pair.sum.damping);
  }
  const Mat6 inverse = inverse_of_positive(G + C);  // C is semidefinite
  const Mat6 IC = inverse * C;
  if (!a.fixed) {
    const Mat6 GIC = k * (G.diagonal().asDiagonal() * IC);
    acting[shell.body].D -= beta * GIC;
    if (set.gradient == H6_EXACT)
      acting[shell.body].K -= k * G * inverse * B;
    else
      acting[shell.body].K -= GIC;
  }
  for (Pair& pair : shell.pairs) {
    if (pair.begin == pair.end) continue;
    const Mat6 Bp = row_major(pair.sum.stiffness), Cp = row_major(pair.sum.damping);
    pair.B = k * (Cp - Cp * IC);
    if (!pair.of_fields) continue;
    BetweenFields& to = *pair.of_fields;
    LinearWrench& on_b = acting[pair.b];
    const Mat6 S = arm_shift(a, bodies[pair.b]);
    to.left = k * S * Cp * inverse;
    to.right = Bp * S.transpose();
    to.right_d = Cp * S.transpose();
    on_b.K -= (k * S * Bp - to.left * Bp) * S.transpose();
    on_b.D -= beta * (k * S * Cp - to.left * Cp) * S.transpose();
    if (!pair.between) continue;
    pair.between->Kab += k * G * inverse * to.right;
    pair.between->Kba += k * S * Bp - to.left * B;
    pair.between->Dab = k * beta * G * inverse * to.right_d;
    pair.between->Dba = beta * (k * S * Cp - to.left * C);
  }
}

}  // namespace h6
