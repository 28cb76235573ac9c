// SPDX-License-Identifier: Apache-2.0
// level_set_peer.cpp - runs OpenVDB, compiled with the bake's flags so that times can be compared.
#include "level_set_peer.h"

#include <oneapi/tbb/global_control.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <vector>

namespace h6::bench {

namespace {

openvdb::FloatGrid::Ptr level_set_of(const io::Mesh& mesh, double voxel_size) {
  openvdb::initialize();
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.vertices.size());
  for (const io::Vec3& v : mesh.vertices) points.emplace_back(v.x, v.y, v.z);
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
      *openvdb::math::Transform::createLinearTransform(voxel_size), points, triangles, 3.0f);
}

}  // namespace

std::size_t mesh_to_level_set(const io::Mesh& mesh, double voxel_size, unsigned threads,
                              std::vector<NodeDistance>* nodes) {
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  const auto grid = level_set_of(mesh, voxel_size);
  if (nodes != nullptr) {
    const std::size_t step = 1 + grid->activeVoxelCount() / 4000;  // half of them are outside
    std::size_t i = 0;
    for (auto it = grid->cbeginValueOn(); it; ++it) {
      if (i++ % step != 0 || !(*it > 0)) continue;
      const openvdb::Vec3d p = grid->indexToWorld(it.getCoord());
      nodes->push_back({{p[0], p[1], p[2]}, static_cast<double>(*it)});
    }
  }
  return grid->tree().leafCount();
}

void write_mesh_as_level_set(const io::Mesh& mesh, double voxel_size,
                             const std::filesystem::path& file) {
  openvdb::io::File(file.string()).write(openvdb::GridPtrVec{level_set_of(mesh, voxel_size)});
}

}  // namespace h6::bench
