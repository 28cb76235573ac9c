// SPDX-License-Identifier: Apache-2.0
// field_check.h - generated meshes, and an independent judge of distance and side for field tests.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <vector>

#include "io/field/field_data.h"
#include "io/mesh/mesh.h"

namespace field_check {

using h6::io::FieldData;
using h6::io::Mesh;
using h6::io::Vec3;
using namespace h6;  // vectors

struct Random {
  std::mt19937_64 engine;
  explicit Random(std::uint64_t seed = 1) : engine(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * double(engine() >> 11) * 0x1p-53;
  }
  std::size_t below(std::size_t n) { return std::size_t(engine() % n); }
};

// ---- Meshes -------------------------------------------------------------------------------------

inline void add(Mesh& mesh, const Mesh& more) {
  const std::uint32_t base = std::uint32_t(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
  for (auto t : more.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

// Quads of a grid over (s, t) in [0,1]^2; vertices are welded by position afterwards.
inline Mesh patch(int n, int m, const std::function<Vec3(double, double)>& at) {
  Mesh mesh;
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i <= n; ++i) mesh.vertices.push_back(at(double(i) / n, double(j) / m));
  const auto v = [&](int i, int j) { return std::uint32_t(j * (n + 1) + i); };
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({v(i, j), v(i + 1, j), v(i + 1, j + 1)});
      mesh.triangles.push_back({v(i, j), v(i + 1, j + 1), v(i, j + 1)});
    }
  return mesh;
}

inline Mesh box(Vec3 low, Vec3 high, int n = 2) {
  Mesh mesh;
  const Vec3 size = high - low;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      add(mesh, patch(n, n, [&](double s, double t) {
            double c[3] = {};
            c[axis] = side;
            c[(axis + 1) % 3] = side ? s : t;
            c[(axis + 2) % 3] = side ? t : s;
            return low + Vec3{c[0] * size.x, c[1] * size.y, c[2] * size.z};
          }));
  return h6::io::weld(mesh);
}

inline Mesh sphere(Vec3 middle, double radius, int n = 24) {
  Mesh mesh = box({-1, -1, -1}, {1, 1, 1}, n);
  for (Vec3& v : mesh.vertices) v = middle + (radius / norm(v)) * v;
  return mesh;
}

inline Mesh torus(double big, double small, int n = 48, int m = 24) {
  Mesh mesh = patch(n, m, [&](double s, double t) {
    const double a = 2 * M_PI * (s < 1 ? s : 0), b = 2 * M_PI * (t < 1 ? t : 0);
    const double r = big + small * std::cos(b);
    return Vec3{r * std::cos(a), r * std::sin(a), small * std::sin(b)};
  });
  return h6::io::weld(mesh);
}

// An L of three unit squares, one unit thick.
inline Mesh l_shape(double unit) {
  const std::array<std::array<double, 2>, 6> outline = {
      {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
  Mesh mesh;
  const auto v = [&](double x, double y, double z) {
    mesh.vertices.push_back({x * unit, y * unit, z * unit});
    return std::uint32_t(mesh.vertices.size() - 1);
  };
  const auto quad = [&](std::array<std::uint32_t, 4> q) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  };
  // Caps of three squares; walls of every unit edge of the outline.
  for (double z : {0.0, 1.0})
    for (auto [x, y] : {std::array{0.0, 0.0}, std::array{1.0, 0.0}, std::array{0.0, 1.0}})
      quad({v(x, y, z), v(x + 1, y, z), v(x + 1, y + 1, z), v(x, y + 1, z)});
  for (std::size_t i = 0; i < 6; ++i) {
    const auto a = outline[i], b = outline[(i + 1) % 6];
    const int steps = int(std::lround(std::fabs(b[0] - a[0]) + std::fabs(b[1] - a[1])));
    for (int k = 0; k < steps; ++k) {
      const double s = double(k) / steps, t = double(k + 1) / steps;
      const double x0 = a[0] + s * (b[0] - a[0]), y0 = a[1] + s * (b[1] - a[1]);
      const double x1 = a[0] + t * (b[0] - a[0]), y1 = a[1] + t * (b[1] - a[1]);
      quad({v(x0, y0, 0), v(x1, y1, 0), v(x1, y1, 1), v(x0, y0, 1)});
    }
  }
  return h6::io::weld(mesh);
}

inline Mesh turned(Mesh mesh, double a, double b) {
  for (Vec3& v : mesh.vertices) {
    v = {std::cos(a) * v.x - std::sin(a) * v.y, std::sin(a) * v.x + std::cos(a) * v.y, v.z};
    v = {v.x, std::cos(b) * v.y - std::sin(b) * v.z, std::sin(b) * v.y + std::cos(b) * v.z};
  }
  return mesh;
}

inline Mesh shifted(Mesh mesh, Vec3 by) {
  for (Vec3& v : mesh.vertices) v = v + by;
  return mesh;
}

// Random sheets and slivers of all sizes.
inline Mesh shards(int count) {
  Mesh mesh;
  Random random(3);
  for (int i = 0; i < count; ++i) {
    const Vec3 at{random(-1, 1), random(-1, 1), random(-1, 1)};
    const double size = std::pow(10, random(-3, 0));
    for (int k = 0; k < 3; ++k)
      mesh.vertices.push_back(
          at + size * Vec3{random(-1, 1), random(-1, 1), (i % 3 ? 1 : 1e-3) * random(-1, 1)});
    const auto first = std::uint32_t(3 * i);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

// ---- The judge ----------------------------------------------------------------------------------

// Nearest point by the seven regions of the triangle (C. Ericson, Real-Time Collision Detection).
inline double distance(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp),
               d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return norm(ap);
  if (d3 >= 0 && d4 <= d3) return norm(bp);
  if (d6 >= 0 && d5 <= d6) return norm(cp);
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return norm(ap - (d1 / (d1 - d3)) * ab);
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return norm(ap - (d2 / (d2 - d6)) * ac);
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return norm(bp - ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b));
  const double s = 1 / (va + vb + vc);
  return norm(ap - (vb * s) * ab - (vc * s) * ac);
}

// A tree of boxes over triangles, halved at the median of the longest side.
class Judge {
 public:
  explicit Judge(const Mesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (const auto& t : mesh.triangles)
      middle_.push_back((1.0 / 3) *
                        (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]));
    if (!order_.empty()) build(0, order_.size());
  }

  double distance(Vec3 p) const {
    double best = 1e300;
    nearest(0, p, best);
    return best;
  }

  // Inside by an odd number of crossings: the majority of five rays.
  bool inside_by_parity(Vec3 p, Random& random) const {
    int votes = 0;
    for (int ray = 0; ray < 5; ++ray) {
      Vec3 d;
      do d = {random(-1, 1), random(-1, 1), random(-1, 1)};
      while (norm(d) > 1 || norm(d) < 0.1);
      std::size_t hits = 0;
      count_hits(0, p, (1 / norm(d)) * d, hits);
      votes += hits % 2;
    }
    return votes >= 3;
  }

  // The triangles that a ray crosses.
  std::size_t hits(Vec3 p, Vec3 direction) const {
    std::size_t hits = 0;
    count_hits(0, p, direction, hits);
    return hits;
  }

  // Generalised winding number: the sum of solid angles over 4 pi. All triangles.
  double winding(Vec3 p) const {
    double sum = 0;
    for (const auto& t : mesh_.triangles) {
      const Vec3 a = mesh_.vertices[t[0]] - p, b = mesh_.vertices[t[1]] - p,
                 c = mesh_.vertices[t[2]] - p;
      const double la = norm(a), lb = norm(b), lc = norm(c);
      sum += 2 * std::atan2(dot(a, cross(b, c)),
                            la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * M_PI);
  }

 private:
  struct Node {
    Vec3 low, high;
    std::size_t begin, end, right;  // right: 0 in a leaf; the left child follows the node
  };
  Vec3 corner(std::size_t i, std::size_t k) const {
    return mesh_.vertices[mesh_.triangles[order_[i]][k]];
  }

  void build(std::size_t begin, std::size_t end) {
    Node node{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}, begin, end, 0};
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 v = corner(i, k);
        node.low = min(node.low, v);
        node.high = max(node.high, v);
      }
    const std::size_t at = nodes_.size();
    nodes_.push_back(node);
    if (end - begin <= 6) return;
    const Vec3 size = node.high - node.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto key = [&](std::uint32_t t) { return component(middle_[t], axis); };
    const std::size_t half = (begin + end) / 2;
    std::nth_element(order_.begin() + long(begin), order_.begin() + long(half),
                     order_.begin() + long(end),
                     [&](std::uint32_t s, std::uint32_t t) { return key(s) < key(t); });
    build(begin, half);
    nodes_[at].right = nodes_.size();
    build(half, end);
  }

  static double gap(const Node& n, Vec3 p) {
    const Vec3 g = {std::max({n.low.x - p.x, p.x - n.high.x, 0.0}),
                    std::max({n.low.y - p.y, p.y - n.high.y, 0.0}),
                    std::max({n.low.z - p.z, p.z - n.high.z, 0.0})};
    return norm(g);
  }

  void nearest(std::size_t at, Vec3 p, double& best) const {
    const Node& n = nodes_[at];
    if (gap(n, p) >= best) return;
    if (n.right == 0) {
      for (std::size_t i = n.begin; i < n.end; ++i)
        best = std::min(best, field_check::distance(p, corner(i, 0), corner(i, 1), corner(i, 2)));
      return;
    }
    const bool left_first = gap(nodes_[at + 1], p) <= gap(nodes_[n.right], p);
    nearest(left_first ? at + 1 : n.right, p, best);
    nearest(left_first ? n.right : at + 1, p, best);
  }

  void count_hits(std::size_t at, Vec3 p, Vec3 d, std::size_t& hits) const {
    const Node& n = nodes_[at];
    double t0 = 0, t1 = 1e300;
    const double o[3] = {p.x, p.y, p.z}, v[3] = {d.x, d.y, d.z};
    const double lo[3] = {n.low.x, n.low.y, n.low.z}, hi[3] = {n.high.x, n.high.y, n.high.z};
    for (int k = 0; k < 3; ++k) {
      const double a = (lo[k] - 1e-12 - o[k]) / v[k], b = (hi[k] + 1e-12 - o[k]) / v[k];
      t0 = std::max(t0, std::min(a, b));
      t1 = std::min(t1, std::max(a, b));
    }
    if (t0 > t1) return;
    if (n.right != 0) {
      count_hits(at + 1, p, d, hits);
      count_hits(n.right, p, d, hits);
      return;
    }
    for (std::size_t i = n.begin; i < n.end; ++i) {
      const Vec3 a = corner(i, 0), e = corner(i, 1) - a, f = corner(i, 2) - a;
      const Vec3 h = cross(d, f);
      const double det = dot(e, h);
      if (det == 0) continue;
      const Vec3 s = p - a, q = cross(s, e);
      const double u = dot(s, h) / det, w = dot(d, q) / det;
      hits += u >= 0 && w >= 0 && u + w <= 1 && dot(f, q) / det > 0;
    }
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Vec3> middle_;
  std::vector<Node> nodes_;
};

// ---- Fields -------------------------------------------------------------------------------------

inline Vec3 node_position(const FieldData& f, std::array<int, 3> n) {
  return f.origin + Vec3{f.voxel_size * n[0], f.voxel_size * n[1], f.voxel_size * n[2]};
}

// The sample at a node, or null where there is no brick or no such node.
inline const float* node_sample(const FieldData& f, std::array<int, 3> n) {
  for (std::size_t k = 0; k < 3; ++k)
    if (n[k] < 0 || n[k] >= 8 * f.bricks[k]) return nullptr;
  const std::size_t cell =
      (std::size_t(n[2] / 8) * std::size_t(f.bricks[1]) + std::size_t(n[1] / 8)) *
          std::size_t(f.bricks[0]) +
      std::size_t(n[0] / 8);
  const std::int32_t row = f.brick_index[cell];
  if (row < 0) return nullptr;
  return &f.samples[std::size_t(row) * 512 +
                    std::size_t(((n[2] & 7) * 8 + (n[1] & 7)) * 8 + (n[0] & 7))];
}

// Calls each(node, sample) for every node that has one.
inline void for_nodes(const FieldData& f,
                      const std::function<void(std::array<int, 3>, double)>& each) {
  for (int k = 0; k < 8 * f.bricks[2]; ++k)
    for (int j = 0; j < 8 * f.bricks[1]; ++j)
      for (int i = 0; i < 8 * f.bricks[0]; ++i)
        if (const float* d = node_sample(f, {i, j, k})) each({i, j, k}, double(*d));
}

// Interpolates between the nodes around p; returns false where one is missing.
inline bool interpolate(const FieldData& f, Vec3 p, double& value) {
  const Vec3 g = (1 / f.voxel_size) * (p - f.origin);
  const std::array<int, 3> n = {int(std::floor(g.x)), int(std::floor(g.y)), int(std::floor(g.z))};
  const double s[3] = {g.x - n[0], g.y - n[1], g.z - n[2]};
  value = 0;
  for (int i = 0; i < 8; ++i) {
    const int b[3] = {i & 1, i >> 1 & 1, i >> 2};
    const float* d = node_sample(f, {n[0] + b[0], n[1] + b[1], n[2] + b[2]});
    if (d == nullptr) return false;
    double w = 1;
    for (int k = 0; k < 3; ++k) w *= b[k] ? s[k] : 1 - s[k];
    value += w * *d;
  }
  return true;
}

}  // namespace field_check
