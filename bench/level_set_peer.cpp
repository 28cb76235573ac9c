// SPDX-License-Identifier: Apache-2.0
// level_set_peer.cpp - runs OpenVDB, compiled with the bake's flags so that times can be compared.
#include "level_set_peer.h"

#include <oneapi/tbb/global_control.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <vector>

namespace h6::bench {

std::size_t mesh_to_level_set(const io::Mesh& mesh, double voxel_size, unsigned threads) {
  openvdb::initialize();
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.vertices.size());
  for (const io::Vec3& v : mesh.vertices) points.emplace_back(v.x, v.y, v.z);
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  const auto grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
      *openvdb::math::Transform::createLinearTransform(voxel_size), points, triangles, 3.0f);
  return grid->tree().leafCount();
}

}  // namespace h6::bench
