// SPDX-License-Identifier: Apache-2.0
// creases.h - candidates where a surface turns: its corners, its edges, and the triangles and
// blunt edges of its curved places. Private to this folder.
#pragma once
#include "io/shell/candidates.h"

namespace h6::io {

// An edge is a crease when normals beside it differ by more than 30 degrees, or when it has another
// number of faces than two. A corner is a place where creases end, meet or turn by as much, or a
// tip. Their candidates carry a normal of their own, the mean of the normals of the faces there (at
// the rim of a sheet, the direction into the sheet).
struct Creases {
  struct Places {
    Candidates of;
    std::vector<std::uint32_t> ridge;  // (candidates) index in `first`
  };
  Places corners, edges;
  Candidates faces;  // one a triangle, and those of blunt edges and vertices
  // The normals of the faces at ridge r that lie more than 60 degrees from its own, no two within
  // 20: [first[r], first[r + 1]) of `normals`. They point into the body.
  std::vector<std::uint32_t> first;
  std::vector<Vec3> normals;
};

// Edges have candidates at their ends and a quarter of `spacing` [m] apart, blunt ones only where
// points so far apart would miss `tolerance` [m]. Only places that the outside reaches have any.
// When the pulse stops, the result is incomplete.
Creases find_creases(const Mesh& mesh, const FaceTable& faces, const Reach& reach, double spacing,
                     double tolerance, Pulse& pulse);

}  // namespace h6::io
