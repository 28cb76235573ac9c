// SPDX-License-Identifier: Apache-2.0
// weighing.h - the weight rules of METHOD.md, Sec. 3, on columns of contacts. A frame and
// h6WeighContacts share them.
#pragma once
#include "kernels/contact/contact_columns.h"
#include "kernels/contact/contact_wrench.h"
#include "kernels/weights/series_solve.h"
#include "runtime/base/math.h"
#include "runtime/contact/contacts.h"
#include "sched/frame_team.h"

namespace h6 {

// Fills facing, T, weight and load of all rows, for every rule but `series` and `firm`. `lever`:
// the body's radius [m]. `team` may be null. `scratch`: weigh_scratch_bytes of c.count or more; up
// to 120 rows need none.
void weigh_columns(Contacts& c, const h6ContactDef& def, double voxel, double lever,
                   sched::FrameTeam* team, void* scratch);
// The scratch that weigh_columns needs for up to `count` contacts, in bytes; 0 when it needs none.
std::size_t weigh_scratch_bytes(const h6ContactDef& def, std::size_t count);

// Calls run(i) for every slice, on the threads of `team`; null: on this one, in order.
template <class Run>
void for_slices(std::size_t slices, sched::FrameTeam* team, const Run& run) {
  if (team) return team->for_slices(slices, run);
  for (std::size_t i = 0; i < slices; ++i) run(i);
}

// Rows begin..end-1.
inline kernels::ContactColumns kernel_columns(const Contacts& c, std::size_t begin,
                                              std::size_t end) {
  return {c.nx + begin, c.ny + begin, c.nz + begin, c.gx + begin, c.gy + begin,
          c.gz + begin, c.rx + begin, c.ry + begin, c.rz + begin, end - begin};
}

// ---- clusters
// ------------------------------------------------------------------------------------

inline bool uses_clusters(const h6ContactDef& def) {
  const bool gauss = def.method == H6_METHOD_GAUSS3 || def.method == H6_METHOD_GAUSS6 ||
                     def.method == H6_METHOD_ROBUST;
  return def.method == H6_METHOD_CLUSTER || (gauss && (def.pieces & H6_PIECE_CLUSTER));
}

struct ClusterScratch {
  std::uint32_t *order, *root;  // (rows)
  std::uint64_t* cell;          // (rows)
};
inline constexpr std::uint32_t kNoCluster = UINT32_MAX;

// Single linkage: two rows of begin..end-1 nearer than `distance` [m] are in one cluster. Every
// cluster becomes one row, written from `out` (<= begin) on: depth, N, g and r are means weighted
// by depth, `point` is that of the deepest row. A cluster whose normals cancel has no direction and
// is left out. Returns the row behind the last. root[i] is then the row that row begin + i went to,
// or kNoCluster. Depths must be above 0.
std::size_t cluster_contacts(Contacts& c, std::size_t begin, std::size_t end, std::size_t out,
                             double distance, const ClusterScratch& scratch);

// ---- series
// --------------------------------------------------------------------------------------

// The lever L, an upper bound on the arms of the body's contacts [m].
inline double series_lever(double radius, double voxel) { return radius > voxel ? radius : voxel; }
// The lever at which the common spring counts turns [m]. Under `firm` it is softer against turns
// than against shifts: METHOD.md, Sec. 3, "Firm".
inline constexpr double kFirmTurn = 0.7;
inline double spring_lever(const h6ContactDef& def, double lever) {
  return def.method == H6_METHOD_FIRM ? kFirmTurn * lever : lever;
}

// Writes e of rows begin..end-1 to load: the depth less the damping at the relative velocity u.
void fill_series_gap(Contacts& c, double beta, const Vec6& u, std::size_t begin, std::size_t end);
// `firm`: notes in slack how much rows begin..end-1 count in the density, and in kappa the
// stiffness rho of their direction. slack holds the depth that each would have if it were carried
// ahead. `voxel`: of their field [m].
void note_firmness(Contacts& c, const h6ContactDef& def, double voxel, std::size_t begin,
                   std::size_t end);
// Writes to weight the stiffness of each contact inside the common spring, in units of k: the
// facing factor; under `firm` its share of rho on the Gauss map, from slack and kappa. `voxel`: of
// the body; `firm` reads facing; `team` may be null; `scratch` as in weigh_columns, not used by
// `series`.
void fill_inner_stiffness(Contacts& c, const h6ContactDef& def, double voxel,
                          sched::FrameTeam* team, void* scratch);
// Fills load and weight (from weight, the inner stiffness, and from load, which has e), kappa with
// the stiffness at the solution, and slack with load / kappa. y holds the start and then the
// extension; `voxel`: of the body; `team` may be null.
kernels::SeriesResult solve_series(Contacts& c, const h6ContactDef& def, double voxel, double lever,
                                   double y[6], sched::FrameTeam* team);
inline kernels::WrenchColumns series_columns(const Contacts& c) {
  return {c.slack, c.kappa, c.nx, c.ny, c.nz, c.gx, c.gy, c.gz, c.rx, c.ry, c.rz, c.count};
}
// sum lambda J, sum kappa J J_g^T and sum kappa J J^T over rows that carry load.
kernels::WrenchSum sum_series_rows(const Contacts& c, bool exact, std::size_t begin,
                                   std::size_t end);
// c S^-2: the spring in unscaled coordinates, in units of k.
Mat6 series_spring(const h6ContactDef& def, double lever);

inline Mat6 row_major(const double m[36]) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(m);
}

}  // namespace h6
