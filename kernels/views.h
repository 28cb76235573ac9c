// SPDX-License-Identifier: Apache-2.0
// views.h - what kernels read: plain pointers and counts, no ownership.
//
// Kernels work in float, in voxels of one field: session state stays in double above them. All
// columns of a view share `count`; any alignment, any count, 0 included.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

// A field in its hot layout. One table entry a brick of 8 x 8 x 8 unit cells:
//   >= 0  row in `bricks`: 9 x 9 x 9 nodes, x fastest, int16 in 1/1024 voxel; the last layer
//         repeats the neighbours' first. Distances there are samples, trilinear between nodes.
//   <  0  no samples. Row -1 - entry in `far`: bounds of |d| at the 8 corners of the cell, x
//         fastest, int16 in 1/32 voxel, with the sign of the side; all 0 where nothing is known. At
//         fractions t in between |d| is at least (field_layout.cpp has the proof)
//             J(t) = sqrt(max(I - 64 sum_a t_a (1 - t_a), min(I, (band + e)^2)))
//         with I = trilinear of squares, e = the way to the cell's end, and, where I < 32^2, at
//         least J at the place where the gradient of I leaves the cell, less the way there: the
//         farther from the surface, the tighter J.
//
//        table (bx*by*bz)       bricks                       far
//        [ 0][-1][-2][ 1] ...   [729 int16, padded][...]     [8 int16][8 int16]...
struct FieldView {
  std::int32_t size[3];       // bricks along x, y, z; nodes 0 .. 8*size - 1
  const std::int32_t* table;  // (size z * y * x), x fastest
  const std::int16_t* bricks;
  const std::int16_t* far;
  float band = 0;  // no point of a far cell is nearer to the surface [voxel]
};
inline constexpr int kBrickNodes = 9 * 9 * 9;
inline constexpr int kBrickStride = 736;  // int16 a brick; a multiple of 32 bytes
// Gathers address bricks by a 32-bit byte offset, so a field may have this many (2.1 GB), no more.
inline constexpr std::size_t kMaxBricks = 0x7fffffffu / (kBrickStride * sizeof(std::int16_t));
inline constexpr float kNearQuantum = 1.0f / 1024.0f;  // voxels
inline constexpr float kFarQuantum = 1.0f / 32.0f;     // voxels
inline constexpr float kAskFarther = 32.0f;            // voxels: see `far`

// q = m * (p, 1): body coordinates [m] to field coordinates [voxel], node (0,0,0) at the origin.
struct Affine {
  float m[3][4];
};

struct PointsView {
  const float *x, *y, *z;
  std::size_t count;
};

// Spheres of one level of a shell; radius in the unit of x, y, z.
struct SpheresView {
  const float *x, *y, *z, *radius;
  std::size_t count;
};

}  // namespace h6::kernels
