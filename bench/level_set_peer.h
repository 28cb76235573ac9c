// SPDX-License-Identifier: Apache-2.0
// level_set_peer.h - OpenVDB's meshToLevelSet, the peer of our field bake.
#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

#include "io/mesh/mesh.h"

namespace h6::bench {

struct NodeDistance {
  h6Vec3 place;
  double distance;  // [m]
};

// Makes a level set with a half-width of 3 voxels on `threads` threads. Returns the number of leaf
// bricks. `nodes`, when given, gets about 2,000 nodes outside, spread over the narrow band.
std::size_t mesh_to_level_set(const io::Mesh& mesh, double voxel_size, unsigned threads,
                              std::vector<NodeDistance>* nodes = nullptr);
// Writes such a level set to a .vdb.
void write_mesh_as_level_set(const io::Mesh& mesh, double voxel_size,
                             const std::filesystem::path& file);

}  // namespace h6::bench
