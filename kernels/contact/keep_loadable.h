// SPDX-License-Identifier: Apache-2.0
// keep_loadable.h - which points, and which groups of points, can carry load before they touch.
//
// Under the rules `series` and `firm` a common spring carries the points of a body a small way
// ahead, the screw motion (v, w): a point at p goes q = v + w x p. Only a point whose inward normal
// opposes q can come into touch so. METHOD.md, Sec. 3. Everything is in the shell's axes, v in
// [voxel], w in [voxel/m].
#pragma once
#include "kernels/contact/expiry.h"
#include "kernels/contact/touch_groups.h"

namespace h6::kernels {

// Keeps, in order and at the front, the rows with
//     max(0, -n.q) > distance
// and returns their number.
std::size_t keep_loadable(const ShellColumns& shell, const Touching& rows, std::size_t count,
                          const float ahead[6]);
std::size_t keep_loadable_ref(const ShellColumns& shell, const Touching& rows, std::size_t count,
                              const float ahead[6]);

// The normals of each group's points lie within `spread` of `n`, a vector of any length.
struct BundlesView {
  const float *nx, *ny, *nz, *spread;
};
// Writes to `survivors`, in order, the groups 16 b + i of the blocks b = blocks[0..count-1] of
// which a point can carry load after the way now[b] [voxel]:
//     expiry <= now[b] + reach,   reach = min(most, max(0, -n.q + spread |q| + |w| radius))
// where q is taken at the centre of the group's sphere. No point of a group farther than its reach
// can carry load; reach[g] is written for all groups of the blocks. Columns are readable to whole
// blocks, `survivors` has room for 16 count. Returns the number of survivors.
std::size_t loadable_groups(const SpheresView& groups, const BundlesView& normals,
                            const float ahead[6], float most, const float* expiry, const float* now,
                            const std::uint32_t* blocks, std::size_t count, float* reach,
                            std::uint32_t* survivors);
std::size_t loadable_groups_ref(const SpheresView& groups, const BundlesView& normals,
                                const float ahead[6], float most, const float* expiry,
                                const float* now, const std::uint32_t* blocks, std::size_t count,
                                float* reach, std::uint32_t* survivors);

}  // namespace h6::kernels
