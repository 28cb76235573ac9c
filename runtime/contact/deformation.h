// SPDX-License-Identifier: Apache-2.0
// deformation.h - a body that bends: its coordinates, its shell as it is bent now, and the forces
// and gradients of its contacts. METHOD.md, Sec. 10.
//
//   follow: spheres of blocks -> traverse: spheres of groups, points of open groups, normals of
//   candidates -> rows of the Jacobian -> sums -> motion/bend_step.cpp
//
// The body is fixed and touches the field of one other body. Arms of its contacts are about the
// centre of mass of that body, which is what turns.
#pragma once
#include <span>

#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

inline constexpr int kRowRoom = 72;  // 6 + H6_MAX_MODES, whole blocks of 8

using ModalVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, H6_MAX_MODES, 1>;
using ModalMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  H6_MAX_MODES, H6_MAX_MODES>;
// Rows of 6 + r numbers: wrench or motion of the rigid body first, then of the modes.
using RowMatrix = Eigen::Map<
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kRowRoom, kRowRoom>, 0,
    Eigen::OuterStride<>>;

// What sums over contacts give: force f, and -df by the relative motion and velocity of (rigid
// body, modes).
struct BentSums {
  std::size_t size = 0, stride = 0;                 // 6 + r, whole blocks of 8
  double* force = nullptr;                          // (stride)
  double *stiffness = nullptr, *damping = nullptr;  // (size x stride)
  RowMatrix K() const { return map(stiffness); }
  RowMatrix D() const { return map(damping); }

 private:
  RowMatrix map(double* at) const {
    const auto n = static_cast<Eigen::Index>(size);
    return {at, n, n, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride))};
  }
};

struct Deformation {
  std::int32_t body = -1, partner = -1;  // the body that bends; the one that it may touch, or -1
  const Shell* shell = nullptr;
  int modes = 0;
  double q[H6_MAX_MODES] = {}, v[H6_MAX_MODES] = {};
  float bent[H6_MAX_MODES] = {};  // q as columns and spheres were made from
  bool followed = false;          // spheres belong to `bent`
  float reach = 0;                // no point is farther from its place at rest [m]
  Vec3 about = Vec3::Zero();      // arms begin here, world frame
  // Where the search of the pair was: as PairSearch::last_place and anchor.
  float last_bent[H6_MAX_MODES] = {}, anchor_bent[H6_MAX_MODES] = {};
  // As in Shell, bent. Points of groups that are not open, and normals of points that are no
  // candidates, are old. Where displacements are warped: they and the turns, with the points.
  Column<float> x, y, z, nx, ny, nz;
  Column<float> ux, uy, uz, wx, wy, wz;
  Tier groups, blocks;
  // Of contacts, by row: rows of the shell; forces along the direction of push and along the
  // field's gradient (`exact`) as rows of 6 + r; load and share of the stiffness in sums.
  std::uint32_t* row = nullptr;
  float *push = nullptr, *slope = nullptr, *load = nullptr, *share = nullptr;
  BentSums sums;
  bool touches = false;  // sums are those of this step
  // The step of the modes: motion/bend_step.cpp.
  double *internal = nullptr, *tangent = nullptr;  // force (padded) and its derivative
  double step[H6_MAX_MODES] = {}, next_v[H6_MAX_MODES] = {};
  double wait[H6_MAX_MODES] = {};                 // change of v if the rigid body did not answer
  Eigen::Matrix<double, H6_MAX_MODES, 6> answer;  // and what it adds by its own change
  Vec6 before = Vec6::Zero();                     // velocity of the rigid body, before the step
  double pace = 0;                                // no point moves farther in the coming step [m]

  Eigen::Map<ModalVector> Q() { return {q, modes}; }
  Eigen::Map<ModalVector> V() { return {v, modes}; }
};

// Where the arms of a shell body's contacts begin.
inline Vec3 arm_origin(const Body& a) { return a.bend ? a.bend->about : a.x; }

// A shell's points and normals as they are now.
struct PointColumns {
  const float *x, *y, *z, *nx, *ny, *nz;
};
inline PointColumns points_of(const Body& a) {
  if (const Deformation* d = a.bend)
    return {d->x.data, d->y.data, d->z.data, d->nx.data, d->ny.data, d->nz.data};
  const Shell& s = *a.shell;
  return {s.x.data, s.y.data, s.z.data, s.nx.data, s.ny.data, s.nz.data};
}

// How far a change of the coordinates carries any point from the shape that d.reach belongs to, at
// most [m].
double bend_way(const Deformation& d, const double* change);
// Takes over the coordinates and the place of the other body: what traversal starts from.
void follow(Deformation& d, std::span<const Body> bodies);
// Bends spheres of the groups of these blocks; points, or normals, of these groups.
void bend_groups(Deformation& d, const std::uint32_t* blocks, std::size_t count);
void bend_points(Deformation& d, const std::uint32_t* groups, std::size_t count);
void bend_normals(Deformation& d, const std::uint32_t* groups, std::size_t count);

// Makes the rows of all contacts along their present directions of push.
void make_bent_rows(const Settings& set, std::span<const Body> bodies, ShellBody& shell);
// Writes e of all contacts to load: the depth less the damping.
void fill_bent_gap(const Settings& set, std::span<const Body> bodies, ShellBody& shell);
// Sums all contacts, with the common spring under `series` and `firm`.
void sum_bent(const Settings& set, std::span<const Body> bodies, ShellBody& shell);
// Adds the wrench on the other body, with its derivatives by that body's own motion.
void add_bent_wrench(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                     std::span<LinearWrench> acting);

// The part of sum_bent for `series` and `firm`, from sums in units of k: METHOD.md, Sec. 3 and 10.
void join_bent_series(const Mat6& spring, double k, bool exact, const BentSums& sums);

}  // namespace h6
