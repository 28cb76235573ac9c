// SPDX-License-Identifier: Apache-2.0
// mesh_distance.cpp - exact distance between two triangle meshes, for the clearances of scenes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

struct Triangle {
  h6Vec3 corner[3];
  h6Vec3 centre;
  double radius;
};

std::vector<Triangle> triangles_of(const Mesh& mesh) {
  std::vector<Triangle> out;
  for (const auto& ids : mesh.triangles) {
    Triangle t{};
    for (int i = 0; i < 3; ++i) {
      t.corner[i] = mesh.vertices[ids[i]];
      t.centre = t.centre + (1.0 / 3) * t.corner[i];
    }
    for (const h6Vec3& p : t.corner) t.radius = std::max(t.radius, norm(p - t.centre));
    out.push_back(t);
  }
  return out;
}

double clamp01(double s) { return std::clamp(s, 0.0, 1.0); }

// Distance of the segments ab and cd. The closest points of their lines count when they lie inside
// both segments; otherwise an end of one segment is the closest.
double segment_distance(const h6Vec3& a, const h6Vec3& b, const h6Vec3& c, const h6Vec3& d) {
  const h6Vec3 u = b - a, v = d - c, w = a - c;
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w);
  const double det = uu * vv - uv * uv;
  // Clamp on the first segment, project onto the second, clamp there and project back.
  const double s0 = det > 1e-12 * uu * vv ? clamp01((uv * vw - vv * uw) / det) : 0;
  const double t = vv > 0 ? clamp01((vw + s0 * uv) / vv) : 0;
  const double s = uu > 0 ? clamp01((t * uv - uw) / uu) : 0;
  return norm(w + s * u - t * v);
}

// Distance of p from the inside of the triangle. It is infinity when the foot of the perpendicular
// lies outside the triangle, because an edge is nearer then.
double face_distance(const h6Vec3& p, const Triangle& t) {
  const h6Vec3 u = t.corner[1] - t.corner[0], v = t.corner[2] - t.corner[0];
  const h6Vec3 n = cross(u, v), w = p - t.corner[0];
  const double nn = dot(n, n);
  if (nn == 0) return std::numeric_limits<double>::infinity();
  const double b = dot(cross(w, v), n) / nn, c = dot(cross(u, w), n) / nn;
  if (b < 0 || c < 0 || b + c > 1) return std::numeric_limits<double>::infinity();
  return std::abs(dot(w, n)) / std::sqrt(nn);
}

bool pierces(const h6Vec3& a, const h6Vec3& b, const Triangle& t) {
  const h6Vec3 n = cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
  const double da = dot(a - t.corner[0], n), db = dot(b - t.corner[0], n);
  if (da * db > 0 || da == db) return false;
  return std::isfinite(face_distance(a + (da / (da - db)) * (b - a), t));
}

double triangle_distance(const Triangle& a, const Triangle& b) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const h6Vec3 &a0 = a.corner[i], &a1 = a.corner[(i + 1) % 3];
    const h6Vec3 &b0 = b.corner[i], &b1 = b.corner[(i + 1) % 3];
    if (pierces(a0, a1, b) || pierces(b0, b1, a)) return 0;
    best = std::min({best, face_distance(a0, b), face_distance(b0, a)});
    for (int j = 0; j < 3; ++j)
      best = std::min(best, segment_distance(a0, a1, b.corner[j], b.corner[(j + 1) % 3]));
  }
  return best;
}

}  // namespace

double mesh_distance(const Mesh& a, const Mesh& b) {
  const std::vector<Triangle> as = triangles_of(a), bs = triangles_of(b);
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& s : as)
    for (const Triangle& t : bs)
      if (norm(s.centre - t.centre) - s.radius - t.radius < best)
        best = std::min(best, triangle_distance(s, t));
  return best;
}

}  // namespace h6::io
