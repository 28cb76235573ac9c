// SPDX-License-Identifier: Apache-2.0
// field_data.h - a baked field in memory: the arrays behind h6FieldDef, with its history.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/types.h"
#include "io/file/samples.h"
#include "io/mesh/mesh.h"

namespace h6::io {

inline constexpr std::int32_t kMaxBricksOnSide = 256;
// Between the finest nodes of a field with a tolerance [tolerance]. Trilinear interpolation of
// exact distances misses half a voxel where two sheets are equally near half way between nodes, 0.6
// where three are, and 0.71 along a wire or a sheet's rim. What coarser cells beside add, comes on
// top.
inline constexpr double kFinest = 1.5;

struct FieldData {
  Vec3 origin{};                         // node (0,0,0), mesh frame [m]
  double voxel_size = 0;                 // [m]
  std::array<std::int32_t, 3> bricks{};  // along x, y, z
  Large<std::int32_t> brick_index;       // (bz x by x bx) row in samples, rising; -1: none
  Samples samples;                       // (brick_count x 512) [m]
  Samples far_grid;                      // ((bz+1) x (by+1) x (bx+1)) signed [m]
  double band = 0;                       // [m]
  std::vector<std::int32_t> part;        // (brick_count) or empty
  std::vector<std::string> part_names;
  // (brick_count) or empty: the mesh's triangle nearest to the middle of the brick; -1 when a
  // sealed hole is nearer.
  std::vector<std::int32_t> triangle;
  // Finer samples of single cells, as in h6FieldDef; all empty where no brick is refined.
  std::vector<std::int32_t> refined;     // (brick_count) row in fine_index, rising; -1: none
  std::vector<std::int32_t> fine_index;  // (refined bricks x 512) see h6FieldDef
  Samples halves;                        // (half_count x 27) [m]
  Samples quarters;                      // (quarter_count x 125) [m]
  // How the bake made the field.
  double offset = 0;       // sigma [m]; 0 on closed meshes
  double grown = 0;        // walls too thin for the nodes are thicker by this, on each side [m]
  std::string sign_mode;   // "closed" or "flood"; "given" by another program
  std::string input_hash;  // of the mesh and the options of the bake
  std::size_t triangles = 0;
  double tolerance = 0;  // that the bake was asked for [m]; 0: none

  // Between the finest nodes [m].
  double finest() const { return tolerance > 0 ? kFinest * tolerance : voxel_size; }
  std::size_t brick_count() const { return samples.size() / 512; }
  std::size_t half_count() const { return halves.size() / 27; }
  std::size_t quarter_count() const { return quarters.size() / 125; }
  h6FieldDef def() const;  // points into this object
};

// Whether the sizes and indices of the arrays fit each other. Files hold consistent fields only.
bool consistent(const FieldData& field);

}  // namespace h6::io
