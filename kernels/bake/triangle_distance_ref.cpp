// SPDX-License-Identifier: Apache-2.0
// triangle_distance_ref.cpp - the specification of triangle_distance: all pairs, in double.
#include <algorithm>
#include <cmath>

#include "kernels/bake/triangle_distance.h"

namespace h6::kernels {
namespace {

struct V {
  double x, y, z;
};
V from(const double p[3]) { return {p[0], p[1], p[2]}; }
V sub(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
V cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// Squared distance to the segment from the origin to e, of a point at w.
double to_segment(V w, V e) {
  const double length2 = dot(e, e);
  const double t = length2 > 0 ? std::clamp(dot(w, e) / length2, 0.0, 1.0) : 0.0;
  const V gap = {w.x - t * e.x, w.y - t * e.y, w.z - t * e.z};
  return dot(gap, gap);
}

}  // namespace

// Over the inside of the triangle the distance is that to the plane, elsewhere that to the nearest
// edge. Planes through the edges along the normal bound the inside.
double point_triangle_squared(const double p[3], const double a[3], const double b[3],
                              const double c[3]) {
  const V ab = sub(from(b), from(a)), bc = sub(from(c), from(b)), ca = sub(from(a), from(c));
  const V pa = sub(from(p), from(a)), pb = sub(from(p), from(b)), pc = sub(from(p), from(c));
  const V n = cross(ca, ab);
  const double n2 = dot(n, n);
  if (n2 > 0 && dot(cross(n, ab), pa) >= 0 && dot(cross(n, bc), pb) >= 0 &&
      dot(cross(n, ca), pc) >= 0) {
    const double height = dot(n, pa);
    return height * height / n2;
  }
  return std::min({to_segment(pa, ab), to_segment(pb, bc), to_segment(pc, ca)});
}

void triangle_distance_ref(const double* corners, std::size_t count, float reach, float* distance) {
  for (std::size_t n = 0; n < kBrickSamples; ++n) {
    const double node[3] = {double(n % 8), double(n / 8 % 8), double(n / 64)};
    double nearest = double(reach) * reach;
    for (std::size_t i = 0; i < count; ++i) {
      const double* t = corners + 9 * i;
      nearest = std::min(nearest, point_triangle_squared(node, t, t + 3, t + 6));
    }
    distance[n] = static_cast<float>(std::sqrt(nearest));
  }
}

void nodes_above_ref(const float* distance, float level, std::uint64_t words[8]) {
  std::fill_n(words, 8, 0);
  for (std::size_t n = 0; n < kBrickSamples; ++n)
    words[n / 64] |= std::uint64_t(distance[n] > level) << (n % 64);
}

}  // namespace h6::kernels
