// SPDX-License-Identifier: Apache-2.0
// bent_wrench.cpp - forces and gradients of the contacts of a body that bends. METHOD.md, Sec. 10.
//
// A contact's row is J = [N; r x N; U^T R^T N], with U = dp/dq of its point: what its force does to
// the rigid body, reversed, and to the modes. Everything that Sec. 2 and 3 say of the 6-vector J
// holds for these rows too.
#include <Eigen/LU>
#include <algorithm>

#include "kernels/bend/bend_sums.h"
#include "kernels/bend/mean_rotation.h"
#include "kernels/bend/warp_points.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/deformation.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

void make_rows(const Body& a, const Deformation& d, const float* dx, const float* dy,
               const float* dz, const Contacts& c, float* out) {
  float turn[9];
  for (int k = 0; k < 9; ++k) turn[k] = static_cast<float>(a.R(k % 3, k / 3));
  const kernels::BentContacts contacts{dx, dy, dz, c.rx, c.ry, c.rz, d.row, c.count};
  const kernels::ModesView modes{d.shell->bend.points.data, static_cast<std::size_t>(d.modes)};
  if (!d.shell->bend.warps) return kernels::contact_rows(contacts, modes, turn, d.sums.stride, out);
  const float* const at[6] = {d.ux.data, d.uy.data, d.uz.data, d.wx.data, d.wy.data, d.wz.data};
  kernels::warp_rows(contacts, modes, at, turn, d.sums.stride, out);
}

// Calls f(i, J.u) for every contact, u the velocity of shell against field, modes included.
template <class F>
void each_rate(std::span<const Body> bodies, const ShellBody& shell, const F& f) {
  const Body& a = bodies[shell.body];
  const Deformation& d = *a.bend;
  double u[kRowRoom] = {};
  for (const Pair& pair : shell.pairs) {
    Vec6::Map(u) = pair_velocity(a, bodies[pair.b]);
    std::copy_n(d.v, d.modes, u + 6);
    for (std::size_t i = pair.begin; i < pair.end; ++i) {
      const float* const row = d.push + i * d.sums.stride;
      double rate = 0;
      for (std::size_t k = 0; k < d.sums.size; ++k) rate += double{row[k]} * u[k];
      f(i, rate);
    }
  }
}

// Load and share of each contact in the sums: of `series` and `firm` in units of k, as the common
// spring leaves them; else the spring's and damper's own, which never pull.
void fill_shares(const Settings& set, std::span<const Body> bodies, const ShellBody& shell) {
  const Contacts& c = shell.contacts;
  const Deformation& d = *bodies[shell.body].bend;
  if (uses_series(set.contact)) {
    for (std::size_t i = 0; i < c.count; ++i) {
      d.share[i] = c.slack[i] > 0 ? c.kappa[i] : 0;
      d.load[i] = d.share[i] * c.slack[i];
    }
    return;
  }
  each_rate(bodies, shell, [&](std::size_t i, double rate) {
    const double e = double{c.depth[i]} - set.contact.damping * rate;
    const double share = e > 0 ? set.contact.stiffness * double{c.weight[i]} : 0;
    d.share[i] = static_cast<float>(share);
    d.load[i] = static_cast<float>(share * e);
  });
}

using Modes = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, H6_MAX_MODES>;

// How a row of the shell moves by q, in the axes of the modes: its point p, its unit normal n, and
// n.d2p/dq2, by which the way of the point is bent (empty where nothing is warped).
struct RowMotion {
  Modes point, normal;
  ModalMatrix bow;
};

// Three columns of a row's modes.
Modes modes_of(const Column<float>& column, std::size_t modes, std::size_t axes, std::size_t first,
               std::size_t row) {
  constexpr std::size_t lanes = kernels::kBendLanes;
  Modes out(3, static_cast<int>(modes));
  for (std::size_t j = 0; j < modes; ++j)
    for (std::size_t k = 0; k < 3; ++k)
      out(static_cast<int>(k), static_cast<int>(j)) =
          double{column[((row / lanes * modes + j) * axes + first + k) * lanes + row % lanes]};
  return out;
}

RowMotion plain_motion(const Deformation& d, std::size_t row, const Vec3& n) {
  const Deformable& bend = d.shell->bend;
  const Modes M = modes_of(bend.normals, bend.modes, 3, 0, row);
  Vec3 bent(d.shell->nx[row], d.shell->ny[row], d.shell->nz[row]);
  for (int j = 0; j < d.modes; ++j) bent += d.q[j] * M.col(j);
  const Mat3 P = 1 / bent.norm() * (Mat3::Identity() - n * n.transpose());
  return {modes_of(bend.points, bend.modes, 3, 0, row), P.lazyProduct(M), {}};
}

// p = R~(w) u, with R~ of kernels/bend/mean_rotation.h, and dn = (R~ dw) x n.
RowMotion warped_motion(const Deformation& d, std::size_t row, const Vec3& n) {
  const Deformable& bend = d.shell->bend;
  const Modes U = modes_of(bend.points, bend.modes, 6, 0, row),
              W = modes_of(bend.points, bend.modes, 6, 3, row);
  const Vec3 u(d.ux[row], d.uy[row], d.uz[row]), w(d.wx[row], d.wy[row], d.wz[row]);
  const kernels::MeanRotation m = kernels::mean_rotation(w.squaredNorm());
  const double(&a)[3] = m.a, (&b)[3] = m.b, (&c)[3] = m.c;
  const Mat3 I = Mat3::Identity(), ww = w * w.transpose();
  const Mat3 mean = a[0] * I + b[0] * cross_matrix(w) + c[0] * ww;
  const double wu = w.dot(u), un = u.dot(n), wn = w.dot(n);
  const Vec3 uxn = u.cross(n);
  // d(R~ u)/dw, then the derivatives of n.R~(w) u by u and w, and by w twice.
  const Vec3 slope = 2 * (a[1] * u + b[1] * w.cross(u) + c[1] * wu * w);
  const Mat3 by_w =
      slope * w.transpose() - b[0] * cross_matrix(u) + c[0] * (w * u.transpose() + wu * I);
  const Vec3 slope_n = 2 * (a[1] * n + b[1] * n.cross(w) + c[1] * wn * w);
  const Mat3 mixed =
      slope_n * w.transpose() + b[0] * cross_matrix(n) + c[0] * (w * n.transpose() + wn * I);
  const Vec3 side = 2 * (b[1] * uxn + c[1] * (wn * u + wu * n));
  const double along = w.dot(uxn);
  const Mat3 twice = 2 * (a[1] * un + b[1] * along + c[1] * wu * wn) * I +
                     4 * (a[2] * un + b[2] * along + c[2] * wu * wn) * ww + side * w.transpose() +
                     w * side.transpose() + c[0] * (u * n.transpose() + n * u.transpose());
  const ModalMatrix cross = U.transpose().lazyProduct(mixed.lazyProduct(W).eval());
  RowMotion out;
  out.point = mean.lazyProduct(U) + by_w.lazyProduct(W);
  out.normal = -cross_matrix(n).lazyProduct(mean.lazyProduct(W).eval());
  out.bow = cross + cross.transpose() + W.transpose().lazyProduct(twice.lazyProduct(W).eval());
  return out;
}

// `exact`: arms grow as points move, normals turn, and warped points go on curves; loads and the
// common spring's J are held, and under `firm` directions too. The force of contact i is load_i
// (its elastic part) times N.
void add_bent_geometry(const Settings& set, const Body& a, const ShellBody& shell) {
  const Contacts& c = shell.contacts;
  const Deformation& d = *a.bend;
  const bool warps = d.shell->bend.warps;
  const bool series = uses_series(set.contact), turns = set.contact.method != H6_METHOD_FIRM;
  RowMatrix K = d.sums.K();
  for (std::size_t i = 0; i < c.count; ++i) {
    const double load = series ? set.contact.stiffness * double{d.load[i]}
                               : double{d.share[i]} * double{c.depth[i]};
    if (load == 0) continue;
    const Vec3 N(c.nx[i], c.ny[i], c.nz[i]), r(c.rx[i], c.ry[i], c.rz[i]);
    const Vec3 n = a.R.transpose() * N;
    const RowMotion by_q = (warps ? warped_motion : plain_motion)(d, d.row[i], n);
    const Modes moved = a.R.lazyProduct(by_q.point), turned = load * by_q.normal;
    K.block(3, 6, 3, d.modes) += (load * cross_matrix(N)).lazyProduct(moved);
    if (warps) K.block(6, 6, d.modes, d.modes) -= load * by_q.bow;
    if (!turns) continue;
    const Modes world = a.R.lazyProduct(turned);
    K.block(0, 6, 3, d.modes) -= world;
    K.block(3, 6, 3, d.modes) -= cross_matrix(r).lazyProduct(world);
    K.block(6, 6, d.modes, d.modes) -= by_q.point.transpose().lazyProduct(turned);
  }
}

// The elastic force on the body that bends.
Vec3 elastic_force(const Settings& set, const ShellBody& shell, const Deformation& d) {
  const Contacts& c = shell.contacts;
  if (uses_series(set.contact)) return Vec3::Map(d.sums.force);
  Vec3 f = Vec3::Zero();
  for (std::size_t i = 0; i < c.count; ++i)
    f += double{d.share[i]} * double{c.depth[i]} * Vec3(c.nx[i], c.ny[i], c.nz[i]);
  return f;
}

}  // namespace

void make_bent_rows(const Settings& set, std::span<const Body> bodies, ShellBody& shell) {
  const Body& a = bodies[shell.body];
  const Contacts& c = shell.contacts;
  make_rows(a, *a.bend, c.nx, c.ny, c.nz, c, a.bend->push);
  if (set.gradient == H6_EXACT) make_rows(a, *a.bend, c.gx, c.gy, c.gz, c, a.bend->slope);
}

void fill_bent_gap(const Settings& set, std::span<const Body> bodies, ShellBody& shell) {
  Contacts& c = shell.contacts;
  each_rate(bodies, shell, [&](std::size_t i, double rate) {
    c.load[i] = static_cast<float>(double{c.depth[i]} - set.contact.damping * rate);
  });
}

void join_bent_series(const Mat6& spring, double k, bool exact, const BentSums& sums) {
  using Rigid = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kRowRoom>;
  using Left = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, kRowRoom, 6>;
  RowMatrix K = sums.K(), D = sums.D();
  const Mat6 inverse = (spring + D.topLeftCorner<6, 6>()).inverse();
  const Left left = D.leftCols<6>().lazyProduct(inverse);
  const auto join = [&](RowMatrix& matrix) {
    const Rigid right = matrix.topRows<6>();
    matrix -= left.lazyProduct(right);
    matrix *= k;
  };
  join(K);
  if (exact) join(D);
  Eigen::Map<Eigen::VectorXd>(sums.force, static_cast<Eigen::Index>(sums.size)) *= k;
}

void sum_bent(const Settings& set, std::span<const Body> bodies, ShellBody& shell) {
  const Body& a = bodies[shell.body];
  Deformation& d = *a.bend;
  const Contacts& c = shell.contacts;
  const bool series = uses_series(set.contact), exact = set.gradient == H6_EXACT;
  d.touches = c.count > 0;
  if (!d.touches) return;
  if (!series) make_bent_rows(set, bodies, shell);
  fill_shares(set, bodies, shell);
  kernels::RowSums rows{d.push, d.push, d.load, d.share, c.count, d.sums.size, d.sums.stride};
  kernels::sum_rows(rows, d.sums.force, d.sums.damping);
  rows.right = d.slope;
  if (exact) kernels::sum_rows(rows, d.sums.force, d.sums.stiffness);
  if (series) {
    const Mat6 spring = series_spring(set.contact, series_lever(a.radius, a.voxel));
    if (exact) {
      join_bent_series(spring, set.contact.stiffness, true, d.sums);
    } else {
      BentSums both = d.sums;
      both.stiffness = d.sums.damping;
      join_bent_series(spring, set.contact.stiffness, false, both);
    }
  }
  const std::size_t all = d.sums.size * d.sums.stride;
  if (!exact) std::copy_n(d.sums.damping, all, d.sums.stiffness);
  for (std::size_t i = 0; i < all; ++i) d.sums.damping[i] *= set.contact.damping;
  if (exact) add_bent_geometry(set, a, shell);
}

void add_bent_wrench(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                     std::span<LinearWrench> acting) {
  const Deformation& d = *bodies[shell.body].bend;
  for (Pair& pair : shell.pairs) {
    if (pair.begin == pair.end) {
      clear_wrench(pair);
      continue;
    }
    const Body& b = bodies[pair.b];
    pair.f = Vec6::Map(d.sums.force);
    const Mat6 K = d.sums.K().topLeftCorner<6, 6>();
    pair.B = K;
    if (b.fixed) continue;
    LinearWrench& on_b = acting[pair.b];
    on_b.f -= pair.f;
    on_b.K -= K;
    on_b.D -= d.sums.D().topLeftCorner<6, 6>();
    if (set.gradient == H6_EXACT)
      on_b.K.bottomLeftCorner<3, 3>() -= cross_matrix(elastic_force(set, shell, d));
  }
}

}  // namespace h6
