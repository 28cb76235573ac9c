// SPDX-License-Identifier: Apache-2.0
#include "io/walls/pieces.h"

#include <algorithm>
#include <cstddef>

namespace h6::io {
namespace {

using Two = std::array<Piece, 2>;

double squared(const Vec3& v) { return dot(v, v); }
Vec3 between(const Vec3& a, const Vec3& b) { return 0.5 * (a + b); }

std::optional<Two> halves_of_triangle(const Piece& piece, double longest2) {
  const auto& c = piece.corner;
  std::size_t at = 0;  // the longest edge begins here
  for (std::size_t k = 1; k < 3; ++k)
    if (squared(c[(k + 1) % 3] - c[k]) > squared(c[(at + 1) % 3] - c[at])) at = k;
  const Vec3 &a = c[at], &b = c[(at + 1) % 3], &tip = c[(at + 2) % 3];
  const double length2 = squared(b - a);
  if (!(length2 > longest2)) return std::nullopt;
  // The tip stands over the longest edge at this share of it, and so high. Of flatter triangles
  // than a thousandth, the squares do not give the height.
  const double share = std::clamp(dot(tip - a, b - a) / length2, 0.0, 1.0);
  const double near_end = std::min(share, 1 - share);
  const double height2 = squared(tip - a) - share * share * length2;
  if (near_end * near_end * length2 > std::max(height2, 1e-6 * length2)) {
    const Vec3 foot = a + share * (b - a);
    return Two{Piece(a, foot, tip), Piece(foot, b, tip)};
  }
  // The shortest edge lies across: from the tip to b, or from a to the tip.
  const Vec3 middle = between(a, b);
  if (share > 0.5) {
    const Vec3 other = between(tip, a);
    return Two{Piece(a, middle, other), Piece(middle, b, tip, other)};
  }
  const Vec3 other = between(b, tip);
  return Two{Piece(b, other, middle), Piece(other, tip, a, middle)};
}

std::optional<Two> halves_of_strip(const Piece& piece, double longest2) {
  const auto& c = piece.corner;
  const double one = std::max(squared(c[1] - c[0]), squared(c[3] - c[2])),
               other = std::max(squared(c[2] - c[1]), squared(c[0] - c[3])),
               across = std::max(squared(c[2] - c[0]), squared(c[3] - c[1]));
  if (!(std::max({one, other, across}) > longest2)) return std::nullopt;
  if (one >= other) {
    const Vec3 low = between(c[0], c[1]), high = between(c[2], c[3]);
    return Two{Piece(c[0], low, high, c[3]), Piece(low, c[1], c[2], high)};
  }
  const Vec3 right = between(c[1], c[2]), left = between(c[3], c[0]);
  return Two{Piece(c[0], c[1], right, left), Piece(left, right, c[2], c[3])};
}

}  // namespace

Vec3 Piece::middle() const {
  Vec3 sum{};
  for (int k = 0; k < corners; ++k) sum = sum + corner[std::size_t(k)];
  return (1.0 / corners) * sum;
}

double Piece::area() const {
  const auto& c = corner;
  const double first = 0.5 * norm(cross(c[1] - c[0], c[2] - c[0]));
  return corners == 3 ? first : first + 0.5 * norm(cross(c[2] - c[0], c[3] - c[0]));
}

std::optional<std::array<Piece, 2>> halves(const Piece& piece, double longest) {
  const double longest2 = longest * longest;
  return piece.corners == 3 ? halves_of_triangle(piece, longest2)
                            : halves_of_strip(piece, longest2);
}

}  // namespace h6::io
