// SPDX-License-Identifier: Apache-2.0
// clearance.h - the distance between two meshes in given poses.
#pragma once
#include "hapsix/result.h"
#include "hapsix/types.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// The least distance [m] to the surface of `other` from all vertices of `part` and from `places`
// random places on it, uniform by area. Poses are of the mesh frames. The result is an upper bound
// of the distance, close to it for meshes finer than their gaps; for parts that overlap it is about
// 0. It is infinity if one of the meshes has no area.
Result<double> clearance(const Mesh& part, const h6Pose& part_pose, const Mesh& other,
                         const h6Pose& other_pose, unsigned threads, std::size_t places = 20000);

}  // namespace h6::io
