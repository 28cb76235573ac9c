// SPDX-License-Identifier: Apache-2.0
// thin_pieces.h - the pieces of a mesh's surface that bound thin walls.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct ThinPieceOptions {
  double thinner_than = 0;  // [m]
  double piece = 0;         // a piece is nowhere longer [m]
  // Whether walls are asked about in this box [m]; empty: everywhere.
  std::function<bool(const Vec3& low, const Vec3& high)> asked;
  unsigned threads = 0;  // 0: all; the result is the same for any number
};

struct ThinPieces {
  Mesh mesh;                         // as few triangles as fill all pieces, with their parts
  std::vector<std::int32_t> source;  // (triangles) in the whole mesh
  double area = 0;                   // [m^2]
  double thickness = 0;              // a tenth of the area bounds thinner walls [m]
  Vec3 place{};                      // of a wall this thick [m]
};

// Triangles are cut into pieces. A piece bounds a thin wall if a ray from its middle straight into
// the solid leaves the solid this soon, through a face that is within 45 degrees of parallel: sharp
// edges are no walls. Two halves that are thin altogether become one piece again. Open sheets are
// not judged. Indices must be in range, vertices finite and welded as read_mesh does.
Result<ThinPieces> thin_pieces(const Mesh& mesh, const ThinPieceOptions& options);

}  // namespace h6::io
