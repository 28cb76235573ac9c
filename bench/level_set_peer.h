// SPDX-License-Identifier: Apache-2.0
// level_set_peer.h - OpenVDB's meshToLevelSet, the peer of our field bake.
#pragma once
#include <cstddef>

#include "io/mesh/mesh.h"

namespace h6::bench {

// Makes a level set with a half-width of 3 voxels on `threads` threads. Returns the number of leaf
// bricks.
std::size_t mesh_to_level_set(const io::Mesh& mesh, double voxel_size, unsigned threads);

}  // namespace h6::bench
