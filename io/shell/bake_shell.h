// SPDX-License-Identifier: Apache-2.0
// bake_shell.h - from a triangle mesh to a shell: nested blue-noise levels and a sphere tree.
#pragma once
#include <optional>
#include <string>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"
#include "io/shell/shell_data.h"

namespace h6::io {

// Where points lie. `triangles`: on the triangles. `field`: where the body's own field is zero. For
// a soup, that surface is the field's offset outside the triangles, so that a body is as thick when
// it moves as when it is touched. `automatic` means `triangles`: with an offset, a nut whose mesh
// lacks a face would jam on its bolt, and the field that it touches has an offset of its own.
enum class ShellSurface { automatic, triangles, field };
// `triangles`: normals of the triangles. `field`: gradients of the distance, which turn smoothly
// over edges. `automatic`: as ShellSurface.
enum class ShellNormals { automatic, triangles, field };
// Their names in files and on the command line: auto, triangles, field.
std::optional<ShellSurface> surface_from_name(const std::string& name);
std::optional<ShellNormals> normals_from_name(const std::string& name);
const char* name_of(ShellSurface surface);
const char* name_of(ShellNormals normals);

struct ShellBake {
  std::size_t points = 10000;  // on the finest level, exactly
  double spacing = 0;          // least distance between points [m]; replaces `points` when > 0
  // > 0: points so close that no flat obstacle enters between them by more than this [m], in place
  // of `points`. `spacing` is then the farthest that points lie apart; 0: 16 tolerances.
  double tolerance = 0;
  int levels = 7;  // 1 .. 16; fewer if there are too few points
  std::uint64_t seed = 1;
  ShellSurface surface = ShellSurface::automatic;
  ShellNormals normals = ShellNormals::automatic;
  FieldBake field;  // of the field that finds the outside; its threads and cavities are ignored
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

// The shell has exactly options.points points, no two nearer than about 0.8 sqrt(area / points).
// The two sides of a thin plate or a sharp wedge (normals more than 134 degrees apart) are sampled
// separately. Every level is a blue-noise subset of the next one, which has 3 to 4 times as many
// points. Normals point INTO the body, however the mesh is wound.
//
// A shell with a tolerance has as many points as it takes. Every place of the surface that the
// outside reaches has a point within 1.25 `spacing`, and one that is at most `tolerance` lower
// along the place's outward normal. Corners and edges (where normals turn by more than 30 degrees)
// have points of their own, with the mean normal of their faces, and with the normal of every face
// that differs from it by more than 60 degrees. Points lie on the triangles.
//
// Only the surface that the outside reaches has points (METHOD.md, Sec. 5): not the inner wall of a
// tank, not faces hidden where parts overlap, not gaps narrower than twice the offset (or about a
// voxel). A closed mesh of one piece counts as reached everywhere. An open sheet has points on both
// sides, each with the normal into the sheet: a moving sheet is touched from either side, and the
// engine drops contacts whose normal faces the wrong way. `warnings` (may be null) gets a sentence
// for each thing that was repaired, hidden or moved.
Result<ShellData> bake_shell(const Mesh& mesh, const ShellBake& options,
                             std::vector<std::string>* warnings, const Progress& progress = {});

// The levels and the sphere tree of given points (a .ply without nodes, a generated grid). Points
// are re-ordered, coarse levels first; none is added or dropped. Normals are unit vectors INTO the
// body. The first level has about points / 4^(levels - 1) points, at least one.
struct PointCloud {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<std::uint32_t> source;  // may be empty
};
Result<ShellData> build_shell(const PointCloud& points, int levels);

}  // namespace h6::io
