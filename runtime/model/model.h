// SPDX-License-Identifier: Apache-2.0
// model.h - what never changes: fields and shells in their hot layout.
#pragma once
#include "hapsix/hapsix.h"
#include "kernels/views.h"
#include "runtime/base/arena.h"
#include "runtime/base/box.h"
#include "runtime/base/math.h"

namespace h6 {

inline constexpr double kBoxMargin = 2;  // the largest margin of a definition [voxel]

struct Field {
  Vec3 origin;         // node (0,0,0), mesh frame [m]
  double voxel = 0;    // [m]
  double finest = 0;   // its finest samples are this far apart [m]: what depths are measured in
  bool wide = false;   // its band is under 3 voxels: culling uses the long form (cull_spheres.h)
  float steepest = 0;  // slope of finer samples, at least 1; 0: there are none (cull_spheres.h)
  // Mesh frame. A point that samples less than kBoxMargin voxels is inside, or outside of the grid
  // and no farther from it than its sample.
  Box box;
  kernels::FieldView view{};
  Buffer<std::int32_t> table;
  Buffer<std::int16_t> bricks, far;  // finer samples lie behind the bricks
  Buffer<std::uint16_t> cuts;
  Buffer<std::int32_t> part, triangle;  // (bricks) or empty
  std::size_t bytes() const {
    return (table.count + part.count + triangle.count) * 4 +
           (bricks.count + far.count + cuts.count) * 2;
  }
};

// A column of memory that something else holds.
template <class T>
struct Column {
  T* data = nullptr;
  std::size_t count = 0;
  void take(Arena& arena, std::size_t n) { data = arena.take<T>(n), count = n; }
  T& operator[](std::size_t i) { return data[i]; }
  const T& operator[](std::size_t i) const { return data[i]; }
};

// Spheres around equal runs of points; the radius is rounded up.
struct Tier {
  std::size_t count = 0;
  Column<float> x, y, z, radius;  // (count, rounded up to whole blocks of 16)
};

// The normals of each group's points: all within `spread` of their mean.
struct Bundles {
  Column<float> nx, ny, nz, spread;  // (groups, rounded up to whole blocks of 16)
};

// Eight points of each group: what is sampled where time is short. The first is the nearest to the
// group's centre, each of the others the farthest from those before it. The first points of a
// block's groups stand next to each other, then their second ones: vector 8 b + j has those of
// block b. Where a group has fewer, its last point stands there again, with kNoRow.
struct Samples {
  static constexpr std::size_t kOfGroup = 8;
  static constexpr int kTiers = 4;  // the first 1, 2, 4, 8 of them
  static constexpr std::uint32_t kNoRow = UINT32_MAX;
  Column<float> x, y, z;      // (8 vectors of 16 a block)
  Column<std::uint32_t> row;  // of the shell
  Column<float>
      reach[kTiers];  // (blocks) from a point of a group to its nearest sample, the longest
};

// How a shell bends: h6DeformableDef. Modes of points and spheres as kernels/bend/bend_points.h has
// them, in the order of the shell's rows; the internal force as bend_sums.h has it.
struct Deformable {
  std::size_t modes = 0;         // r; 0: the shell is rigid
  bool warps = false;            // modes are those of kernels/bend/warp_points.h, without normals
  bool linear = false;           // the internal force
  double alpha = 0, beta = 0;    // damping [1/s], [s]
  Column<float> groups, blocks;  // of their spheres
  Column<double> force;
  Column<float> points, normals;  // (rows)
  Buffer<char> memory;
  std::size_t point_axes() const { return warps ? 6 : 3; }
  std::size_t sphere_axes() const { return warps ? 8 : 4; }
};

// A shell's points in three flat tiers. Rows are sorted so that those next to each other are near
// each other (split at medians): 16 rows are a group, 16 groups a block, each with its smallest
// sphere. Coordinates are relative to `centre`, so that float serves meshes far from their origin.
struct Shell {
  Vec3 centre;                        // mesh frame [m]
  double radius = 0;                  // farthest point from the centre [m]
  Box box;                            // around all points, mesh frame [m]
  std::size_t points = 0;             // rows; columns repeat the last one up to a whole block
  Column<float> x, y, z, nx, ny, nz;  // normals point inward
  Column<std::uint32_t> point;        // of the definition
  // Points of a group that face one way and lie near each other are a cell: rows of equal numbers,
  // one behind the other. METHOD.md, Sec. 3, "Firm".
  Column<std::uint32_t> cell;
  Tier groups, blocks;
  Bundles normals;  // of groups
  Samples samples;
  Buffer<char> memory;  // of all columns: together they lie on few pages
  Deformable bend;
  bool bends() const { return bend.modes > 0; }
  std::size_t bytes() const { return memory.count + bend.memory.count; }
};
inline constexpr std::size_t kGroupRows = 16, kBlockRows = 256;

// Convert one definition; false with a sentence when it is not valid or memory is out.
bool convert_field(const h6FieldDef& def, const h6ModelDef& model, Field* field, h6Error* error);
bool convert_shell(const h6ShellDef& def, const h6Allocator& allocator, Shell* shell,
                   h6Error* error);
// Adds how a converted shell bends.
bool convert_deformable(const h6DeformableDef& def, const h6Allocator& allocator, Shell* shell,
                        h6Error* error);

// Writes the sentence (when there is somebody to read it) and returns false.
bool fail(h6Error* error, const char* format, ...) __attribute__((format(printf, 2, 3)));
// The same with another code than H6_ERROR_ARGUMENT.
bool fail(h6Error* error, h6ErrorCode code, const char* format, ...)
    __attribute__((format(printf, 3, 4)));

// Words of `reserved` that are set ask for something that only a later version knows.
template <class Def>
bool check_reserved(const Def& def, const char* where, h6Error* error) {
  for (const std::uint64_t word : def.reserved)
    if (word != 0)
      return fail(error,
                  "%sreserved is not zero: begin with the default function of the definition, or "
                  "use a later version of hapsix, which the program was compiled for",
                  where);
  return true;
}

}  // namespace h6

struct h6Model {
  h6Allocator allocator{};
  h6::Field* fields = nullptr;
  std::size_t field_count = 0;
  h6::Shell* shells = nullptr;
  std::size_t shell_count = 0;
};
