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
//   >= 0  row in `bricks`, plus kRefined where cells of the brick have finer samples: 9 x 9 x 9
//   nodes, x fastest, int16 in 1/1024 voxel; the last layer
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
//
// Refined bricks have the first rows. `fine` lies behind `bricks` in the same array, so that one
// gather fetches samples of either; both together take at most 2 GB. The same row of `cuts` starts
// with an int32, a unit of 32 int16 in `fine`, and has one code for each cell, x fastest, from
// kCutHead on: 0, or the number of units from there times 2, plus 1 where the cell is cut into
// quarters. In `fine`, a cell cut into f = 2 or 4 has its (f + 1)^3 nodes, x fastest, in 1/(1024 f)
// voxel, in one unit or in four.
struct FieldView {
  std::int32_t size[3];       // bricks along x, y, z; nodes 0 .. 8*size - 1
  const std::int32_t* table;  // (size z * y * x), x fastest
  const std::int16_t* bricks;
  const std::int16_t* far;
  float band = 0;  // no point of a far cell is nearer to the surface [voxel]
  const std::uint16_t* cuts = nullptr;
  const std::int16_t* fine = nullptr;
};
inline constexpr std::int32_t kRefined = 1 << 30;
inline std::int32_t row_of(std::int32_t entry) { return entry & ~kRefined; }  // entry >= 0
inline constexpr int kCutHead = 32, kCutStride = kCutHead + 512;  // uint16 a refined brick
inline constexpr int kFineUnit = 32;                              // int16
inline constexpr int kHalfUnits = 1, kQuarterUnits = 4;
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
