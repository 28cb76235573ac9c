// SPDX-License-Identifier: Apache-2.0
// clearance.h - how far one mesh is from another, where they stand.
#pragma once
#include "hapsix/result.h"
#include "hapsix/types.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// The least distance [m] from the surface of `part` to that of `other`, in the poses of their mesh
// frames: from all vertices of triangles and from `places` more, evenly by area. So an upper bound,
// close to the truth for meshes finer than their gaps; parts that run into each other are about 0
// apart. Infinity where one has no area.
Result<double> clearance(const Mesh& part, const h6Pose& part_pose, const Mesh& other,
                         const h6Pose& other_pose, unsigned threads, std::size_t places = 20000);

}  // namespace h6::io
