// bake_shell.h - from a triangle mesh to a shell: nested blue-noise levels and their sphere tree.
#pragma once
#include "hapsix/result.h"
#include "io/mesh.h"
#include "io/progress.h"
#include "io/shell_data.h"

namespace h6::io {

struct ShellBake {
  std::size_t points = 10000;  // on the finest level, exactly; not used when
  double spacing = 0;          // this is > 0: least distance between points [m]
  int levels = 7;              // 1 .. 16; fewer when there are too few points
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

// Exactly the number asked for, no two nearer than about 0.8 sqrt(area / points) - but the two
// sides of a thin plate or a sharp wedge (normals more than 134 degrees apart) are sampled each for
// itself. Every level is a blue-noise subset of the next one; counts grow 3 to 4 times a level.
// Normals are those of the triangles, turned INTO the body; `warnings` (may be null) hears where
// the mesh does not say what that is. All surfaces are sampled, inner ones too.
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
