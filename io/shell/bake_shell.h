// SPDX-License-Identifier: Apache-2.0
// bake_shell.h - from a triangle mesh to a shell: nested blue-noise levels and their sphere tree.
#pragma once
#include <optional>
#include <string>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"
#include "io/shell/shell_data.h"

namespace h6::io {

// Where points lie. `triangles`: on them. `field`: where the body's own field is zero: in soups
// that is the field's offset outside of the triangles, so a body is as thick when it moves as when
// it is touched. `automatic`: on the triangles: a nut whose mesh lacks a face would jam on its bolt
// if it were moved out, and the field it touches keeps an offset of its own.
enum class ShellSurface { automatic, triangles, field };
// `field`: of the distance, so they turn evenly over edges. `automatic`: as the points.
enum class ShellNormals { automatic, triangles, field };
// auto, triangles, field: their names in files and on the command line.
std::optional<ShellSurface> surface_from_name(const std::string& name);
std::optional<ShellNormals> normals_from_name(const std::string& name);
const char* name_of(ShellSurface surface);
const char* name_of(ShellNormals normals);

struct ShellBake {
  std::size_t points = 10000;  // on the finest level, exactly; not used when
  double spacing = 0;          // this is > 0: least distance between points [m]
  int levels = 7;              // 1 .. 16; fewer when there are too few points
  std::uint64_t seed = 1;
  ShellSurface surface = ShellSurface::automatic;
  ShellNormals normals = ShellNormals::automatic;
  FieldBake field;       // how the outside is found; its threads and cavities are not used
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

// Exactly the number asked for, no two nearer than about 0.8 sqrt(area / points) - but the two
// sides of a thin plate or a sharp wedge (normals more than 134 degrees apart) are sampled each for
// itself. Every level is a blue-noise subset of the next one; counts grow 3 to 4 times a level.
// Normals point INTO the body, however the mesh is wound.
//
// Only what the outside reaches has points, as in the field of METHOD.md, Sec. 5: not the inner
// wall of a tank, not faces hidden where parts overlap, not gaps narrower than twice the offset (or
// about a voxel). A closed mesh of one piece is all outside. An open sheet has points on both
// sides, each with the normal into the sheet: a sheet that moves is touched from either side, and a
// contact whose normal faces the wrong way would be thrown away. `warnings` (may be null) hears
// what was repaired, hidden or moved.
Result<ShellData> bake_shell(const Mesh& mesh, const ShellBake& options,
                             std::vector<std::string>* warnings, const Progress& progress = {});

// The levels and the sphere tree of points given by somebody else (a .ply without nodes, a
// generated grid). Points are re-ordered coarse first; nothing is added or dropped. Normals are
// unit vectors INTO the body. The first level has about points / 4^(levels - 1) points, at least
// one.
struct PointCloud {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<std::uint32_t> source;  // may be empty
};
Result<ShellData> build_shell(const PointCloud& points, int levels);

}  // namespace h6::io
