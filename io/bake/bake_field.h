// SPDX-License-Identifier: Apache-2.0
// bake_field.h - from a triangle mesh or soup to a sparse signed distance field.
//
// The sign is that of H. Xu, J. Barbic, "Signed distance fields for polygon soup meshes", 2014.
// inside.cpp derives the samples inside.
#pragma once
#include <cstdint>
#include <optional>

#include "hapsix/result.h"
#include "io/field/field_data.h"
#include "io/file/free_memory.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// `automatic`: closed meshes by `flood` without an offset, others by `flood` with one. `flood`: all
// that the outside cannot reach is inside. `winding`: a solid with cracks and holes is closed where
// its winding number passes one half, without an offset.
enum class SignMode { automatic, flood, winding };
// Regions that the outside cannot reach. `solid` fills them all. `hollow` counts the fewest walls
// on any way from outside and leaves a region empty where that number is even: a ball inside a
// hollow ball is solid again. But parts that overlap become hollow where they overlap, so `hollow`
// is only for separate shells, with walls at least two voxels thick.
enum class Cavities { solid, hollow };

// A brick finds the surface in itself and in the bricks beside it.
inline constexpr double kWidestBand = 8;  // [voxel]

struct FieldBake {
  int voxels = 256;       // cells on the longest padded side, 16 .. 2048
  double voxel_size = 0;  // [m] replaces `voxels` when > 0
  // > 0: the largest error [m] within 9 tolerances of the surface, in place of voxels: coarse
  // voxels of 6 tolerances, cut into 2 or 4 where they would miss it. The cut ones decide about
  // sides, holes and the automatic offset.
  double tolerance = 0;
  double offset = -1;  // sigma [m]; < 0: automatic (0 for closed meshes, else 0.9 voxel)
  SignMode sign = SignMode::automatic;
  Cavities cavities = Cavities::solid;
  // > 0: closes holes and cracks of an open mesh up to this width [m], so that a part with missing
  // triangles does not drain. Where the mesh is wound like a solid, these are the ways into it;
  // else gaps narrower than this that lead to anything deeper, while concave corners stay open. Has
  // no effect on closed meshes. Under `winding`, 0 is any width up to 32 voxels.
  double seal = 0;
  // Welds vertices of open edges that are nearer than this to each other, where it closes the mesh
  // [voxel], 0 .. 1; 0: only equal ones. A hundredth moves the surface less than the samples are
  // off between nodes, and is a thousand times the rounding of an STL.
  double weld = 0.01;
  double weld_length = 0;  // [m] at most a (fine) voxel; replaces `weld` when > 0
  double band_voxels = 3;  // cells nearer than this to the surface get samples, 1 ..
                           // kWidestBand; deeper than this, depth is only bounded
  int padding_voxels = 8;  // empty cells around the mesh
  // Moves the nodes against the mesh, whose centre they share else [voxel], each -0.5 .. 0.5. For
  // studies of what a result owes to the place of the nodes; no scene file has it.
  h6Vec3 shift{};
  // Whether walls too thin for the voxels grow (bake_field). For studies; no scene file has it.
  bool grow_thin = true;
  unsigned threads = 0;  // 0: all
  // The bytes that are free, or no value where nothing tells. A bake asks before it takes much, and
  // fails with a sentence where it would take more. For tests; no scene file has it.
  std::optional<std::uint64_t> (*free_memory)() = [] { return io::free_memory(); };
};

// The report of a bake for its user.
struct FieldBakeReport {
  bool closed = false;
  double sealed_area = 0;  // [m^2] put across holes
  struct Hole {
    h6Vec3 place;  // [m]
    double width;  // [m] of a ball that can pass, give or take a voxel
  };
  std::vector<Hole> sealed;  // widest first
  std::vector<Hole> leaks;   // none, or one that is open and drains the solid
  struct Thin {
    double area = 0;             // of both sides [m^2]; 0: there are none
    double thickness = 0;        // a tenth of the area bounds thinner walls [m]
    h6Vec3 place{};              // of a wall this thick [m]
    double below = 0, grow = 0;  // walls thinner than `below` grew by `grow` on each side [m]
  } thin;
  std::size_t welded = 0;             // vertices, moved by `weld`
  double weld_widest = 0;             // [m] farthest that one of them moved
  std::vector<std::string> warnings;  // a sentence each
  // Wall time of the stages, in the order of work.
  struct Stage {
    std::string name;
    double seconds;
  };
  std::vector<Stage> stages;
};

// The samples. Outside: distance to the surface minus offset, exact up to band + 2 voxels and a
// lower bound beyond. Inside a closed mesh: minus the distance to the surface, with the same
// limits. Inside a soup: minus (distance + offset), the way out through the nearest sheet; between
// that sheet and the zero set, distance - offset. Where sheets are buried in the solid, because
// parts overlap, the way out is up to 0.74 voxel + 13 % too short, and in a few places too long
// (inside.cpp). far_grid: a lower bound of the distance; outside it is at most a voxel below.
//
// The walls of a closed mesh that are thinner than one and a half (fine) voxels would be lost
// between the nodes. They become obstacles like open sheets, 0.9 voxel thicker on each side, and
// the report says where.
Result<FieldData> bake_field(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report,
                             const Progress& progress = {});

}  // namespace h6::io
