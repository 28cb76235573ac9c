// SPDX-License-Identifier: Apache-2.0
// Triangles cut into pieces.
#include "io/walls/pieces.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/io/bake/field_check.h"

using namespace h6;  // vectors
using namespace h6::io;
using field_check::Random;

namespace {

void cut(const Piece& piece, double longest, std::vector<Piece>& out) {
  if (const auto two = halves(piece, longest)) {
    for (const Piece& half : *two) cut(half, longest, out);
  } else {
    out.push_back(piece);
  }
}

std::vector<Piece> pieces_of(const Piece& piece, double longest) {
  std::vector<Piece> out;
  cut(piece, longest, out);
  return out;
}

Vec3 normal(const Piece& piece) {
  const auto& c = piece.corner;
  return cross(c[1] - c[0], c[2] - c[0]);
}

}  // namespace

TEST_CASE("pieces fill their triangle, face as it does, and are nowhere longer than asked") {
  Random random(7);
  for (int n = 0; n < 200; ++n) {
    const double flat = std::pow(10, random(-3, 0));
    const auto corner = [&] {
      return Vec3{random(-20, 20), flat * random(-20, 20), random(-1, 1)};
    };
    const Piece whole(corner(), corner(), corner());
    const double longest = random(1.5, 4);
    const Vec3 up = normal(whole);
    double area = 0;
    for (const Piece& piece : pieces_of(whole, longest)) {
      area += piece.area();
      CHECK(dot(normal(piece), up) > 0);
      const Vec3 middle = piece.middle();
      for (int a = 0; a < piece.corners; ++a) {
        const Vec3 &from = piece.corner[std::size_t(a)],
                   &to = piece.corner[std::size_t((a + 1) % piece.corners)];
        CHECK(dot(cross(to - from, middle - from), up) > 0);  // the middle lies in the piece
        for (int b = 0; b < a; ++b)
          CHECK(norm(from - piece.corner[std::size_t(b)]) <= longest * (1 + 1e-12));
      }
    }
    CHECK(area == doctest::Approx(whole.area()).epsilon(1e-9));
  }
}

TEST_CASE("a narrow triangle becomes about as many pieces as it is pieces long") {
  for (const double length : {10.0, 100.0, 1000.0}) {
    CAPTURE(length);
    const Vec3 a{0, 0, 0}, b{length, 0, 0};
    for (const double tip : {0.0, 0.03, 0.3, 0.5, 0.52, 0.7, 0.95, 1.0}) {
      CAPTURE(tip);
      for (const double height : {1e-4, 0.5})
        CHECK(pieces_of(Piece(a, b, {tip * length, height, 0}), 2).size() <= 1.3 * length);
    }
  }
}

TEST_CASE("a wide triangle becomes some pieces for each square as wide as a piece") {
  for (const double tip : {0.0, 0.2, 0.5, 0.9, 1.0})
    for (const double height : {10.0, 60.0, 100.0}) {
      CAPTURE(tip);
      CAPTURE(height);
      const Piece whole({0, 0, 0}, {100, 0, 0}, {100 * tip, height, 0});
      CHECK(pieces_of(whole, 2).size() < 1.5 * whole.area() + 300);
    }
}
