// SPDX-License-Identifier: Apache-2.0
// exact_check.h - compares a baked field with its mesh: exact distances, sides by votes of rays,
// and the bound far from the surface as the engine reads it. It shares no code with the bake.
#pragma once
#include <cstdint>

#include "hapsix/result.h"
#include "io/field/field_data.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct ExactCheckOptions {
  std::size_t points = 20000;      // places near the mesh
  std::size_t far_points = 50000;  // places where the engine has only a bound
  std::uint64_t seed = 1;
  bool sealed = false;   // the bake closed holes: the surface may be nearer than the mesh
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

struct ExactCheck {
  bool closed = false;  // every edge of the mesh has an even number of faces
  // Nodes nearer than the band to the mesh: |sample - what bake_field.h says it is| [voxel].
  std::size_t nodes = 0;
  double worst_node = 0, mean_node = 0;
  std::size_t buried = 0;  // other nodes, nearest to a buried sheet: not comparable
  std::size_t grown = 0;   // other nodes, near thin walls that the bake made thicker
  std::size_t odd = 0;     // of these, with neither the mesh's distance nor the thicker wall's
  std::size_t nearer = 0;  // other nodes, nearer to the surface than to the mesh: sealed holes
  // Other nodes, deeper than their distance to the mesh although the outside lies beyond it: next
  // to buried sheets the bake's way out may be too long [voxel].
  std::size_t deep = 0;
  double worst_deep = 0;
  // Places outside, near the mesh and between nodes: the error of trilinear interpolation [voxel].
  std::size_t between = 0;
  double worst_between = 0, mean_between = 0;
  // Where the field has a tolerance: places within 9 tolerances of the mesh and between nodes, and
  // the error there in tolerances. A place with another side than rays find has the sum of both
  // distances as its error. Not counted are places near walls that grew, places in the solid beside
  // a part of the mesh that lies buried in it, and, where there is an offset, places that a gap too
  // narrow for it has closed.
  std::size_t asked = 0, missed = 0;  // missed: by more than one tolerance
  double worst_asked = 0, mean_asked = 0;
  // Sides of nodes near the mesh and of places anywhere in the grid. A ray votes inside if it
  // crosses the mesh an odd number of times, or leaves more closed pieces than it enters. A vote
  // counts if at least nine in ten rays agree.
  std::size_t voted = 0, doubtful = 0;
  std::size_t solid = 0;     // votes for inside
  std::size_t drained = 0;   // the field says outside, rays say inside
  Vec3 leak{};               // the drained place deepest inside the mesh [m]
  double leak_depth = 0;     // its distance from the mesh [voxel]
  std::size_t filled = 0;    // the field says inside, rays found a way out: wrong if closed
  std::size_t enclosed = 0;  // the field says inside, rays outside, no way out was found: cavities
  // In places without samples: the engine's lower bound of the distance [voxel].
  std::size_t far = 0, far_wrong = 0;
  double far_excess = 0;  // the most that a bound is above the distance
  // How far bounds are below the distance on average: outside; at the far grid's own nodes outside;
  // inside (a tenth of the places, where the outside lies beyond the nearest triangle).
  std::size_t outside = 0, inside = 0;  // number of places
  double far_gap = 0, corner_gap = 0, inside_gap = 0;

  std::size_t wrong_sides() const { return drained + filled; }
  // Whether the outside runs into a solid through cracks or holes of its mesh. In the three real
  // soups that were tried, rays found no place inside that the field calls outside; two votes in a
  // thousand are allowed.
  bool drains() const { return !closed && 500 * drained > solid; }
  // Whether the field is right. In a soup only drains() judges sides: a sheet has no inside.
  bool agrees() const {
    return worst_node < 1e-3 && missed == 0 && far_wrong == 0 && 20 * deep <= nodes &&
           10 * odd <= grown && (closed ? wrong_sides() == 0 : !drains());
  }
};

// Needs a field of this mesh. Fails, with a sentence, if the mesh has no area, if the field is of
// another mesh, or when the user cancels.
Result<ExactCheck> check_exactly(const Mesh& mesh, const FieldData& field,
                                 const ExactCheckOptions& options, const Progress& progress = {});

}  // namespace h6::io
