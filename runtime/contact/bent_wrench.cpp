// SPDX-License-Identifier: Apache-2.0
// bent_wrench.cpp - forces and gradients of the contacts of a body that bends. METHOD.md, Sec. 10.
//
// A contact's row is J = [N; r x N; U^T R^T N]: what its force does to the rigid body, reversed,
// and to the modes. Everything that Sec. 2 and 3 say of the 6-vector J holds for these rows too.
#include <Eigen/LU>
#include <algorithm>

#include "kernels/bend/bend_points.h"
#include "kernels/bend/bend_sums.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/deformation.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

void make_rows(const Body& a, const Deformation& d, const float* dx, const float* dy,
               const float* dz, const Contacts& c, float* out) {
  float turn[9];
  for (int k = 0; k < 9; ++k) turn[k] = static_cast<float>(a.R(k % 3, k / 3));
  kernels::contact_rows({dx, dy, dz, c.rx, c.ry, c.rz, d.row, c.count},
                        {d.shell->bend.points.data, static_cast<std::size_t>(d.modes)}, turn,
                        d.sums.stride, out);
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

// `exact`: arms grow as points move, and normals turn; loads and the common spring's J are held,
// and under `firm` directions too. The force of contact i is load_i (its elastic part) times N.
void add_bent_geometry(const Settings& set, const Body& a, const ShellBody& shell) {
  const Contacts& c = shell.contacts;
  const Deformation& d = *a.bend;
  const Deformable& bend = d.shell->bend;
  const bool series = uses_series(set.contact), turns = set.contact.method != H6_METHOD_FIRM;
  constexpr std::size_t lanes = kernels::kBendLanes;
  using Modes = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, H6_MAX_MODES>;
  Modes U(3, d.modes), M(3, d.modes);
  RowMatrix K = d.sums.K();
  for (std::size_t i = 0; i < c.count; ++i) {
    const double load = series ? set.contact.stiffness * double{d.load[i]}
                               : double{d.share[i]} * double{c.depth[i]};
    if (load == 0) continue;
    const std::size_t row = d.row[i];
    for (int j = 0; j < d.modes; ++j)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t at =
            ((row / lanes * bend.modes + static_cast<std::size_t>(j)) * 3 + k) * lanes +
            row % lanes;
        U(static_cast<int>(k), j) = bend.points[at], M(static_cast<int>(k), j) = bend.normals[at];
      }
    const Vec3 N(c.nx[i], c.ny[i], c.nz[i]), r(c.rx[i], c.ry[i], c.rz[i]);
    const auto RU = a.R.lazyProduct(U);
    K.block(3, 6, 3, d.modes) += (load * cross_matrix(N)).lazyProduct(RU.eval());
    if (!turns) continue;
    const Vec3 n = a.R.transpose() * N, rest(d.shell->nx[row], d.shell->ny[row], d.shell->nz[row]);
    Vec3 bent = rest;
    for (int j = 0; j < d.modes; ++j) bent += d.q[j] * M.col(j);
    const Mat3 P = load / bent.norm() * (Mat3::Identity() - n * n.transpose());
    const Modes turned = P.lazyProduct(M), world = a.R.lazyProduct(turned);
    K.block(0, 6, 3, d.modes) -= world;
    K.block(3, 6, 3, d.modes) -= cross_matrix(r).lazyProduct(world);
    K.block(6, 6, d.modes, d.modes) -= U.transpose().lazyProduct(turned);
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
