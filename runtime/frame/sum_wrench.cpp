// SPDX-License-Identifier: Apache-2.0
// sum_wrench.cpp - a pair's wrench on both of its bodies, and how it changes as they move.
//
// The kernel sums over the shell body's arms. The field body's Jacobian is J_b = -[N; r_b x N] with
// r_b = r_a + c, c = x_a - x_b: J_b = -S J_a, S = [I 0; [c]x I]. So every block follows from the
// shell body's own sums, and no contact is touched twice. METHOD.md, Sec. 2.
#include <algorithm>

#include "runtime/frame/stages.h"
#include "runtime/frame/weighing.h"
#include "sched/clock.h"

namespace h6 {
namespace {

// Into pair.sum.
void sum_slices(h6Session& s, const Contacts& c, Pair& pair, const kernels::WrenchParameters& p) {
  const kernels::WrenchColumns columns{c.depth, c.weight, c.nx, c.ny, c.nz, c.gx,
                                       c.gy,    c.gz,     c.rx, c.ry, c.rz, c.count};
  const std::size_t count = pair.end - pair.begin, slices = (count + kSumSlice - 1) / kSumSlice;
  const auto sum_slice = [&](std::size_t i, kernels::WrenchSum& sum) {
    kernels::contact_wrench(columns, p, pair.begin + i * kSumSlice,
                            std::min(pair.begin + (i + 1) * kSumSlice, pair.end), sum);
  };
  if (slices <= 1 || s.team->threads() == 1) {
    sum_slice(0, pair.sum);
    for (std::size_t i = 1; i < slices; ++i) {
      kernels::WrenchSum next;
      sum_slice(i, next);
      pair.sum.add(next);
    }
    return;
  }
  const std::int64_t since = sched::now_ns();
  const auto keep = [&](std::size_t i) { sum_slice(i, s.slice_sum[i]); };
  if (s.summing.share(count))
    s.team->for_slices(slices, keep);
  else
    for (std::size_t i = 0; i < slices; ++i) keep(i);
  s.summing.took(static_cast<double>(sched::now_ns() - since));
  pair.sum = s.slice_sum[0];
  for (std::size_t i = 1; i < slices; ++i) pair.sum.add(s.slice_sum[i]);
}

}  // namespace

Mat6 arm_shift(const h6Session& s, const Pair& pair) {
  Mat6 S = Mat6::Identity();
  S.bottomLeftCorner<3, 3>() = cross_matrix(s.bodies[pair.a].x - s.bodies[pair.b].x);
  return S;
}

Vec6 pair_velocity(const h6Session& s, const Pair& pair) {
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  Vec6 ua, ub;
  ua << a.v, a.w;
  ub << b.v, b.w;
  return ua - arm_shift(s, pair).transpose() * ub;
}

void add_geometric_terms(h6Session& s, Pair& pair, const Vec6& f) {
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Mat3 F = cross_matrix(f.head<3>()), T = cross_matrix(f.tail<3>());
  if (!a.fixed) {
    a.K.topRightCorner<3, 3>() -= F;
    a.K.bottomRightCorner<3, 3>() -= T;
  }
  // The arms from b grow as a and b part, and turn as a turns.
  if (!b.fixed) b.K.bottomLeftCorner<3, 3>() -= F;
  if (a.fixed || b.fixed) return;
  pair.Kba.topRightCorner<3, 3>() += F;
  pair.Kba.bottomLeftCorner<3, 3>() += F;
  pair.Kba.bottomRightCorner<3, 3>() += T + cross_matrix(a.x - b.x) * F;
}

void spread_wrench(h6Session& s, Pair& pair, const kernels::WrenchSum& sum) {
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Mat6 S = arm_shift(s, pair);
  const Vec6 f = Vec6::Map(sum.force);
  pair.f = f;
  pair.B = row_major(sum.damping);
  const Mat6 K = row_major(sum.stiffness), D = s.contact.damping * pair.B;
  if (!a.fixed) {
    a.f += f;
    a.K -= K;
    a.D -= D;
  }
  if (!b.fixed) {
    b.f -= S * f;
    b.K -= S * K * S.transpose();
    b.D -= S * D * S.transpose();
  }
  if (!a.fixed && !b.fixed) {
    pair.Kab = K * S.transpose();
    pair.Kba = S * K;
    pair.Dab = D * S.transpose();
    pair.Dba = S * D;
  }
  if (s.gradient == H6_EXACT) add_geometric_terms(s, pair, Vec6::Map(sum.elastic));
}

void sum_contacts(h6Session& s, Pair& pair) {
  if (pair.begin == pair.end) return;
  kernels::WrenchParameters p{s.contact.stiffness, s.contact.damping, {}, s.gradient == H6_EXACT};
  Vec6::Map(p.velocity) = pair_velocity(s, pair);
  sum_slices(s, s.contacts[pair.a], pair, p);
}

void add_wrench(h6Session& s, Pair& pair) {
  if (pair.begin != pair.end) return spread_wrench(s, pair, pair.sum);
  for (Mat6* block : {&pair.Kab, &pair.Kba, &pair.Dab, &pair.Dba, &pair.B}) block->setZero();
  pair.f.setZero();
}

}  // namespace h6
