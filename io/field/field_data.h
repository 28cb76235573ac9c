// SPDX-License-Identifier: Apache-2.0
// field_data.h - a baked field in memory: what h6FieldDef points at, with its history.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/types.h"
#include "io/file/samples.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct FieldData {
  Vec3 origin{};                          // node (0,0,0), mesh frame [m]
  double voxel_size = 0;                  // [m]
  std::array<std::int32_t, 3> bricks{};   // along x, y, z
  std::vector<std::int32_t> brick_index;  // rows rise with the cells
  Samples samples;                        // (brick_count x 512) [m]
  std::vector<float> far_grid;            // ((bz+1) x (by+1) x (bx+1)) signed [m]
  double band = 0;                        // [m]
  std::vector<std::int32_t> part;         // (brick_count) or empty
  std::vector<std::string> part_names;
  std::vector<std::int32_t> triangle;  // (brick_count) or empty: of the mesh as it was given,
                                       // nearest to the brick's middle; -1: a sealed hole is
  // How it was made; kept in the file's metadata.
  double offset = 0;       // sigma [m]; 0 on closed meshes
  std::string sign_mode;   // "closed" or "flood"; "given": from another program
  std::string input_hash;  // of the mesh's content and the bake parameters
  std::size_t triangles = 0;

  std::size_t brick_count() const { return samples.size() / 512; }
  h6FieldDef def() const;  // points into this object
};

}  // namespace h6::io
