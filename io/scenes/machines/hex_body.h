// SPDX-License-Identifier: Apache-2.0
// hex_body.h - what bends in generated scenes: hexahedra on a bent grid, and the skin of them.
#pragma once
#include <array>
#include <functional>

#include "io/scene/scene.h"

namespace h6::io {

struct HexBody {
  using Place = std::array<int, 3>;  // of a cell, or of its lowest corner

  Place cells{};        // along the grid's axes; bent, these stay right-handed
  bool closed = false;  // the second axis goes round: its last corners are its first
  int split = 1;        // parts of a cell's edge in the skin
  SolidMaterial material;
  std::function<h6Vec3(const Place& corner)> at;  // [m]
  std::function<bool(const Place& cell)> solid;   // null: each cell of the grid is
  std::function<bool(const Place& corner)> fixed;
};

SolidMesh hex_solid(const HexBody& body);
// Every vertex of the skin lies on a face of a hexahedron, so the modes fit it. Wound outward.
Mesh hex_skin(const HexBody& body);
// A fixed body whose shell of `points` bends.
SceneBody bending(const char* name, const HexBody& body, std::size_t points);

}  // namespace h6::io
