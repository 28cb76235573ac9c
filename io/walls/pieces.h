// SPDX-License-Identifier: Apache-2.0
// pieces.h - cuts triangles into pieces that are nowhere longer than a length.
#pragma once
#include <array>
#include <optional>

#include "io/mesh/mesh.h"

namespace h6::io {

// A triangle, or a flat convex quadrilateral, with the corners in the triangle's order.
struct Piece {
  std::array<Vec3, 4> corner;
  int corners;

  Piece(const Vec3& a, const Vec3& b, const Vec3& c) : corner{a, b, c}, corners(3) {}
  Piece(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
      : corner{a, b, c, d}, corners(4) {}
  // A place in the piece.
  Vec3 middle() const;
  double area() const;
};

// Two parts of a piece; none if it is nowhere longer than `longest` (> 0, in the unit of its
// corners).
//
// A triangle becomes a shorter one and a strip across, and a strip two shorter strips, so a narrow
// triangle as long as n pieces becomes some n. Where its tip is farther from both ends of the
// longest edge than it is high, it is first cut from the tip down. If only longest edges were
// halved, some n^1.58 pieces would come out, since a half can be as long as the whole.
std::optional<std::array<Piece, 2>> halves(const Piece& piece, double longest);

}  // namespace h6::io
