// SPDX-License-Identifier: Apache-2.0
// distance_facet.cpp - prepares a triangle, in double, for the float work of triangle_distance.cpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/bake/triangle_distance.h"

namespace h6::kernels {
namespace {

using Row = std::array<double, 3>;
double dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Row cross(const Row& a, const Row& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Row times(double s, const Row& a) { return {s * a[0], s * a[1], s * a[2]}; }

void set_function(DistanceFacet& f, std::size_t k, const Row& g, const Row& zero_at) {
  f.gx[k] = float(g[0]);
  f.gy[k] = float(g[1]);
  f.gz[k] = float(g[2]);
  f.c[k] = float(-dot(g, zero_at));
}

// Unit, across a.
Row any_normal(const Row& a) {
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::fabs(a[k]) < std::fabs(a[least])) least = k;
  Row e{};
  e[least] = 1;
  const Row n = cross(a, e);
  return times(1 / std::sqrt(dot(n, n)), n);
}

// The segment from `from` along the unit vector `along`, as all three edges of a triangle without
// an inside.
void set_segment(DistanceFacet& f, const Row& from, const Row& along, double length) {
  const Row n = any_normal(along), in = cross(n, along);
  const Row middle = {from[0] + length / 2 * along[0], from[1] + length / 2 * along[1],
                      from[2] + length / 2 * along[2]};
  for (std::size_t e = 0; e < 3; ++e) {
    set_function(f, e, along, middle);
    set_function(f, 3 + e, in, from);
    f.half[e] = float(length / 2);
  }
  set_function(f, 6, n, from);
  f.inside_from = 1e30f;
}

}  // namespace

DistanceFacet make_distance_facet(const double* t) {
  DistanceFacet f;
  f.gx[7] = f.gy[7] = f.gz[7] = f.c[7] = 0;
  const Row corner[3] = {{t[0], t[1], t[2]}, {t[3], t[4], t[5]}, {t[6], t[7], t[8]}};
  Row edge[3];
  double length[3];
  std::size_t longest = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    const Row &a = corner[e], &b = corner[(e + 1) % 3];
    edge[e] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    length[e] = std::sqrt(dot(edge[e], edge[e]));
    if (length[e] > length[longest]) longest = e;
    f.low[e] = float(std::min({corner[0][e], corner[1][e], corner[2][e]}));
    f.high[e] = float(std::max({corner[0][e], corner[1][e], corner[2][e]}));
  }
  const Row n = cross(edge[2], edge[0]);
  const double n_length = std::sqrt(dot(n, n)), height_over = n_length / length[longest];
  // A triangle lower than 1e-4 voxel is its longest edge to within that height.
  if (!(height_over > 1e-4)) {
    const Row along =
        length[longest] > 1e-9 ? times(1 / length[longest], edge[longest]) : Row{1, 0, 0};
    set_segment(f, corner[longest], along, length[longest]);
    return f;
  }
  const Row normal = times(1 / n_length, n);
  for (std::size_t e = 0; e < 3; ++e) {
    const Row along = times(1 / length[e], edge[e]);
    const Row &a = corner[e], &b = corner[(e + 1) % 3];
    set_function(f, e, along, {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2});
    set_function(f, 3 + e, cross(normal, along), corner[e]);
    f.half[e] = float(length[e] / 2);
  }
  set_function(f, 6, normal, corner[0]);
  // Points on an edge must count as over the triangle in spite of rounding. On a sliver the
  // tolerance must not reach past its tips.
  f.inside_from = -float(std::min(2e-6, 1e-5 * height_over / length[longest]));
  return f;
}

}  // namespace h6::kernels
