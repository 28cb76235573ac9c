// SPDX-License-Identifier: Apache-2.0
// winding_numbers_ref.cpp - the specification of winding_numbers.cpp.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/bake/winding_numbers.h"

namespace h6::kernels {
namespace {

struct Place {
  float x, y, z;
};
float dot(const Place& a, const Place& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

float dipole(const WindingCluster& c, const Place& p) {
  const Place to{c.middle[0] - p.x, c.middle[1] - p.y, c.middle[2] - p.z};
  const float far2 = dot(to, to);
  return (to.x * c.dipole[0] + to.y * c.dipole[1] + to.z * c.dipole[2]) / (far2 * std::sqrt(far2));
}

// The direction (x, y) after `full` turns.
struct Turns {
  float x = 1, y = 0, full = 0;
};

// Half the solid angle of each triangle turns the sum (A. van Oosterom, J. Strackee, "The solid
// angle of a plane triangle", 1983). It is less than half a turn, so the side of the real axis
// before and after tells a full turn, and one arc tangent serves all triangles.
void turn(const WindingLeaf& leaf, const Place& p, Turns& sum) {
  Place to[24];
  float length[24];
  for (std::uint32_t v = 0; v < leaf.vertices; ++v) {
    to[v] = {leaf.x[v] - p.x, leaf.y[v] - p.y, leaf.z[v] - p.z};
    length[v] = std::sqrt(dot(to[v], to[v]));
  }
  for (std::uint32_t t = 0; t < leaf.triangles; ++t) {
    const std::uint8_t* corner = &leaf.corner[3 * t];
    const Place &a = to[corner[0]], &b = to[corner[1]], &c = to[corner[2]];
    const float la = length[corner[0]], lb = length[corner[1]], lc = length[corner[2]];
    const Place n{b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x};
    float y = dot(a, n), x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    const float most = std::max(std::fabs(x), std::fabs(y));
    if (!(most > 1e-30f)) continue;  // p is on the triangle's rim
    x /= most, y /= most;
    const float before = sum.y;
    sum.y = sum.x * y + before * x;
    sum.x = sum.x * x - before * y;
    if (y >= 0)
      sum.full += before >= 0 && sum.y < 0 ? 1.0f : 0.0f;
    else
      sum.full -= before < 0 && sum.y >= 0 ? 1.0f : 0.0f;
  }
  const float most = std::max(std::fabs(sum.x), std::fabs(sum.y));
  sum.x /= most, sum.y /= most;
}

}  // namespace

void winding_numbers_ref(const WindingCluster* clusters, const std::uint32_t* far,
                         std::size_t far_count, const WindingLeaf* leaves,
                         const std::uint32_t* near, std::size_t near_count, const double (&base)[3],
                         const WindingPlaces& offsets, float (&number)[kWindingPlaces]) {
  for (std::size_t i = 0; i < kWindingPlaces; ++i) {
    const auto place = [&](const double(&origin)[3]) {
      return Place{offsets.x[i] + float(base[0] - origin[0]),
                   offsets.y[i] + float(base[1] - origin[1]),
                   offsets.z[i] + float(base[2] - origin[2])};
    };
    float sum = 0;
    const Place p = place({0, 0, 0});
    for (std::size_t k = 0; k < far_count; ++k) sum += dipole(clusters[far[k]], p);
    Turns turns;
    for (std::size_t k = 0; k < near_count; ++k)
      turn(leaves[near[k]], place(leaves[near[k]].origin), turns);
    number[i] = float(double(sum) + double(turns.full) +
                      std::atan2(double(turns.y), double(turns.x)) / (2 * std::numbers::pi));
  }
}

}  // namespace h6::kernels
