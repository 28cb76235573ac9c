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
  double edge2[3];  // from corner k to the next
  for (std::size_t k = 0; k < 3; ++k) edge2[k] = squared(c[(k + 1) % 3] - c[k]);
  const auto longest = std::size_t(std::max_element(edge2, edge2 + 3) - edge2);
  if (!(edge2[longest] > longest2)) return std::nullopt;
  const auto shortest = std::size_t(std::min_element(edge2, edge2 + 3) - edge2);
  const double second2 = edge2[0] + edge2[1] + edge2[2] - edge2[longest] - edge2[shortest];
  if (second2 > longest2 && 4 * edge2[shortest] < edge2[longest]) {
    const Vec3 &a = c[shortest], &b = c[(shortest + 1) % 3], &tip = c[(shortest + 2) % 3];
    const Vec3 by_a = between(tip, a), by_b = between(tip, b);
    return Two{Piece(tip, by_a, by_b), Piece(by_a, a, b, by_b)};
  }
  const Vec3 &a = c[longest], &b = c[(longest + 1) % 3], &tip = c[(longest + 2) % 3];
  const Vec3 middle = between(a, b);
  return Two{Piece(a, middle, tip), Piece(middle, b, tip)};
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
