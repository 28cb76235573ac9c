// SPDX-License-Identifier: Apache-2.0
// sum_wrench.cpp - a pair's wrench on both of its bodies, and its derivatives by their motion.
//
// The kernel sums over the shell body's arms. The field body's Jacobian is J_b = -[N; r_b x N] with
// r_b = r_a + c, c = x_a - x_b: J_b = -S J_a, S = [I 0; [c]x I]. So every block follows from the
// shell body's own sums, and no contact is read twice. METHOD.md, Sec. 2.
#include <algorithm>

#include "runtime/contact/contact_stages.h"
#include "runtime/contact/deformation.h"
#include "runtime/contact/weighing.h"
#include "sched/clock.h"

namespace h6 {
namespace {

// Sums of slices are added in order, so any number of threads gives the same bits.
void sum_slices(const kernels::WrenchColumns& columns, const Pair& pair,
                const kernels::WrenchParameters& p, Lane& lane, kernels::WrenchSum& out) {
  const std::size_t count = pair.end - pair.begin, slices = (count + kSumSlice - 1) / kSumSlice;
  const auto sum_slice = [&](std::size_t i, kernels::WrenchSum& sum) {
    kernels::contact_wrench(columns, p, pair.begin + i * kSumSlice,
                            std::min(pair.begin + (i + 1) * kSumSlice, pair.end), sum);
  };
  if (slices == 1) return sum_slice(0, out);
  kernels::WrenchSum* const sums = lane.scratch->slice_sum;
  share_slices(lane, lane.summing, count, slices, [&](std::size_t i) { sum_slice(i, sums[i]); });
  out = sums[0];
  for (std::size_t i = 1; i < slices; ++i) out.add(sums[i]);
}

}  // namespace

void clear_wrench(Pair& pair) {
  pair.f.setZero();
  pair.B.setZero();
  if (pair.between) *pair.between = {};
  if (pair.of_fields) *pair.of_fields = {};
}

Mat6 arm_shift(const Body& a, const Body& b) {
  Mat6 S = Mat6::Identity();
  S.bottomLeftCorner<3, 3>() = cross_matrix(arm_origin(a) - b.x);
  return S;
}

Vec6 pair_velocity(const Body& a, const Body& b) {
  // u_a - S^T u_b, S as in arm_shift.
  Vec6 u;
  u << a.v - b.v + (arm_origin(a) - b.x).cross(b.w), a.w - b.w;
  if (a.bend) u.head<3>() += a.w.cross(a.bend->about - a.x);
  return u;
}

void add_geometric_terms(const Sides& sides, Pair& pair, const Vec6& f) {
  const Body &a = sides.a, &b = sides.b;
  const Mat3 F = cross_matrix(f.head<3>()), T = cross_matrix(f.tail<3>());
  if (!a.fixed) {
    sides.on_a.K.topRightCorner<3, 3>() -= F;
    sides.on_a.K.bottomRightCorner<3, 3>() -= T;
  }
  // The arms from b grow as a and b part, and turn as a turns.
  if (!b.fixed) sides.on_b.K.bottomLeftCorner<3, 3>() -= F;
  if (!pair.between) return;
  Mat6& Kba = pair.between->Kba;
  Kba.topRightCorner<3, 3>() += F;
  Kba.bottomLeftCorner<3, 3>() += F;
  Kba.bottomRightCorner<3, 3>() += T + cross_matrix(a.x - b.x) * F;
}

void spread_wrench(const Settings& set, const Sides& sides, Pair& pair,
                   const kernels::WrenchSum& sum) {
  const Body &a = sides.a, &b = sides.b;
  const Mat6 S = arm_shift(a, b);
  const Vec6 f = Vec6::Map(sum.force);
  pair.f = f;
  pair.B = row_major(sum.damping);
  const Mat6 K = row_major(sum.stiffness), D = set.contact.damping * pair.B;
  if (!a.fixed) {
    sides.on_a.f += f;
    sides.on_a.K -= K;
    sides.on_a.D -= D;
  }
  if (!b.fixed) {
    sides.on_b.f -= S * f;
    sides.on_b.K -= S * K * S.transpose();
    sides.on_b.D -= S * D * S.transpose();
  }
  if (pair.between) {
    pair.between->Kab = K * S.transpose();
    pair.between->Kba = S * K;
    pair.between->Dab = D * S.transpose();
    pair.between->Dba = S * D;
  }
  if (set.gradient == H6_EXACT) add_geometric_terms(sides, pair, Vec6::Map(sum.elastic));
}

void sum_contacts(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  if (bodies[shell.body].bend) return sum_bent(set, bodies, shell);
  const bool series = uses_series(set.contact), exact = set.gradient == H6_EXACT;
  const Contacts& c = shell.contacts;
  kernels::WrenchColumns columns = series_columns(c);
  kernels::WrenchParameters p{1.0, 0.0, {}, exact};
  if (!series) {
    columns.depth = c.depth, columns.weight = c.weight;
    p = {set.contact.stiffness, set.contact.damping, {}, exact};
  }
  for (Pair& pair : shell.pairs) {
    if (pair.begin == pair.end) continue;
    if (!series) Vec6::Map(p.velocity) = pair_velocity(bodies[pair.a], bodies[pair.b]);
    sum_slices(columns, pair, p, lane, pair.sum);
  }
}

void add_wrenches(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                  std::span<LinearWrench> acting) {
  if (bodies[shell.body].bend) return add_bent_wrench(set, bodies, shell, acting);
  const bool series = uses_series(set.contact);
  for (Pair& pair : shell.pairs) {
    const Sides sides = sides_of(pair, bodies, acting);
    if (pair.begin == pair.end) {
      clear_wrench(pair);
    } else if (series) {
      spread_series(set, sides, pair, pair.sum);
    } else {
      spread_wrench(set, sides, pair, pair.sum);
    }
  }
  if (series && shell.contacts.count > 0) join_series(set, bodies, shell, acting);
  for (Pair& pair : shell.pairs)
    if (pair.friction) add_friction(set, sides_of(pair, bodies, acting), pair, *pair.friction);
}

}  // namespace h6
