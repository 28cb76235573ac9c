// sum_wrench.cpp - a pair's wrench on both of its bodies, and how it changes as they move.
//
// The kernel sums over the shell body's arms. The field body's Jacobian is J_b = -[N; r_b x N] with
// r_b = r_a + c, c = x_a - x_b: J_b = -S J_a, S = [I 0; [c]x I]. So every block follows from the
// shell body's own sums, and no contact is touched twice. METHOD.md, Sec. 2.
#include <algorithm>

#include "runtime/stages.h"

namespace h6 {
namespace {

constexpr std::size_t kSlice = 1024;  // contacts summed at a time; slices are added in order

using MapMat6 = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>;
using MapVec6 = Eigen::Map<const Vec6>;

kernels::WrenchSum sum_slices(h6Session& s, const Contacts& c, const Pair& pair,
                              const kernels::WrenchParameters& p) {
  const kernels::WrenchColumns columns{c.depth, c.weight, c.nx, c.ny, c.nz, c.gx,
                                       c.gy,    c.gz,     c.rx, c.ry, c.rz, c.count};
  const std::size_t count = pair.end - pair.begin, slices = (count + kSlice - 1) / kSlice;
  if (slices <= 1) return kernels::contact_wrench(columns, p, pair.begin, pair.end);
  s.team->for_slices(slices, [&](std::size_t i) {
    s.slice_sum[i] = kernels::contact_wrench(columns, p, pair.begin + i * kSlice,
                                             std::min(pair.begin + (i + 1) * kSlice, pair.end));
  });
  kernels::WrenchSum total = s.slice_sum[0];
  for (std::size_t i = 1; i < slices; ++i) total.add(s.slice_sum[i]);
  return total;
}

}  // namespace

void sum_wrench(h6Session& s, Pair& pair) {
  pair.Kab.setZero();
  pair.Kba.setZero();
  pair.Dab.setZero();
  pair.Dba.setZero();
  if (pair.begin == pair.end) return;
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Vec3 c = a.x - b.x;
  Mat6 S = Mat6::Identity();
  S.bottomLeftCorner<3, 3>() = cross_matrix(c);

  // Velocity of a against b at a's centre of mass: u_a - S^T u_b.
  Vec6 ua, ub;
  ua << a.v, a.w;
  ub << b.v, b.w;
  const Vec6 u = ua - S.transpose() * ub;
  kernels::WrenchParameters p{s.contact.stiffness, s.contact.damping, {}, s.gradient == H6_EXACT};
  Vec6::Map(p.velocity) = u;
  const kernels::WrenchSum sum = sum_slices(s, s.contacts[pair.a], pair, p);

  const Vec6 f = MapVec6(sum.force);
  const Mat6 K = MapMat6(sum.stiffness), D = s.contact.damping * MapMat6(sum.damping);
  Mat6 aa = Mat6::Zero(), ba = Mat6::Zero(), bb = Mat6::Zero();  // geometric terms
  if (s.gradient == H6_EXACT) {
    const Mat3 F = cross_matrix(MapVec6(sum.elastic).head<3>()),
               T = cross_matrix(MapVec6(sum.elastic).tail<3>());
    aa.topRightCorner<3, 3>() = -F;
    aa.bottomRightCorner<3, 3>() = -T;
    // The arms from b grow as a and b part, and turn as a turns.
    ba.topRightCorner<3, 3>() = F;
    ba.bottomLeftCorner<3, 3>() = F;
    ba.bottomRightCorner<3, 3>() = T + cross_matrix(c) * F;
    bb.bottomLeftCorner<3, 3>() = -F;
  }
  if (!a.fixed) {
    a.f += f;
    a.K += aa - K;
    a.D -= D;
  }
  if (!b.fixed) {
    b.f -= S * f;
    b.K += bb - S * K * S.transpose();
    b.D -= S * D * S.transpose();
  }
  if (!a.fixed && !b.fixed) {
    pair.Kab = K * S.transpose();
    pair.Kba = S * K + ba;
    pair.Dab = D * S.transpose();
    pair.Dba = S * D;
  }
}

}  // namespace h6
