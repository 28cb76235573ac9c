// SPDX-License-Identifier: Apache-2.0
// exact_check.h - a baked field against the mesh it is of: distances that are exact, sides by votes
// of rays, the bound far from the surface as the engine reads it. Nothing of the bake is used.
#pragma once
#include <cstdint>

#include "hapsix/result.h"
#include "io/field/field_data.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct ExactCheckOptions {
  std::size_t points = 20000;      // of each kind
  std::size_t far_points = 50000;  // where the engine has a bound only
  std::uint64_t seed = 1;
  bool sealed = false;   // holes were closed: the surface may be nearer than the mesh
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

struct ExactCheck {
  bool closed = false;  // every edge of the mesh has an even number of faces
  // Nodes nearer than the band to the mesh: |sample - what bake_field.h says it is| [voxel].
  std::size_t nodes = 0;
  double worst_node = 0, mean_node = 0;
  std::size_t buried = 0;  // others, nearest to what is buried in the solid: not comparable
  std::size_t nearer = 0;  // others, nearer to the surface than to the mesh: sealed holes
  // Others, deeper than the mesh is near although there is outside beyond it: where sheets are
  // buried close by, the bake's estimate of the way out may be too long [voxel].
  std::size_t deep = 0;
  double worst_deep = 0;
  // Any places outside and near: the error of trilinear interpolation, apart [voxel].
  std::size_t between = 0;
  double worst_between = 0, mean_between = 0;
  // Sides of nodes near the mesh and of places anywhere in the grid. A ray votes inside when it
  // crosses the mesh an odd number of times, or leaves more closed pieces than it enters; votes
  // count where at least nine in ten agree.
  std::size_t voted = 0, doubtful = 0;
  std::size_t drained = 0;   // outside, but rays say inside. Wrong in a closed mesh.
  std::size_t filled = 0;    // inside, but rays say outside, and a way out is known. Likewise.
  std::size_t enclosed = 0;  // inside, but rays say outside; no way out was found: cavities
  // In places without samples: the engine's lower bound of the distance [voxel].
  std::size_t far = 0, far_wrong = 0;
  double far_excess = 0;  // most above the distance
  // Mean below the distance: outside, likewise of the far grid itself at its own nodes, and inside,
  // of a tenth of the places, where what is nearest has outside beyond it. Of how many places.
  std::size_t outside = 0, inside = 0;
  double far_gap = 0, corner_gap = 0, inside_gap = 0;

  std::size_t wrong_sides() const { return drained + filled; }
  // A closed mesh, and nothing wrong with its field; of a soup the sides are a matter of opinion.
  bool agrees() const {
    return worst_node < 1e-3 && far_wrong == 0 && 20 * deep <= nodes &&
           (!closed || wrong_sides() == 0);
  }
};

Result<ExactCheck> check_exactly(const Mesh& mesh, const FieldData& field,
                                 const ExactCheckOptions& options, const Progress& progress = {});

}  // namespace h6::io
