// SPDX-License-Identifier: Apache-2.0
// nearest_triangle.cpp - a node's triangles are split at the median of their centres, so that the
// tree is balanced for any mesh. Distances are double; boxes are float, rounded outwards.
#include "io/mesh/nearest_triangle.h"

#include <algorithm>
#include <cmath>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::uint32_t leaf_size = 4;

// False when the height over the longest side is below 1e-12 of that side: this is rounding.
bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b, n = cross(u, v);
  const double longest2 = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return dot(n, n) > 1e-24 * longest2 * longest2;
}

Vec3 nearest_on_edge(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 u = b - a;
  const double uu = dot(u, u);
  return a + (uu > 0 ? std::clamp(dot(p - a, u) / uu, 0.0, 1.0) : 0) * u;
}

// The foot of the perpendicular when it lies in the triangle, else the nearest point of the edges.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
                         const Vec3& n) {
  const Vec3 w = p - a, x = cross(n, w);
  const Vec3 u = b - a, v = c - a;
  const double at_b = dot(x, v), at_c = -dot(x, u), all = dot(cross(u, v), n);  // barycentric
  if (at_b >= 0 && at_c >= 0 && at_b + at_c <= all) return p - dot(w, n) * n;
  Vec3 best = nearest_on_edge(p, a, b);
  for (const Vec3& q : {nearest_on_edge(p, b, c), nearest_on_edge(p, c, a)}) {
    const Vec3 d = q - p, e = best - p;
    if (dot(d, d) < dot(e, e)) best = q;
  }
  return best;
}

std::uint32_t nodes_of(std::uint32_t items) {
  return items <= leaf_size ? 1 : 1 + nodes_of(items / 2) + nodes_of(items - items / 2);
}

float down(double v) { return std::nextafter(float(v), -INFINITY); }
float up(double v) { return std::nextafter(float(v), INFINITY); }

double box_distance2(const float low[3], const float high[3], const Vec3& p) {
  const double place[3] = {p.x, p.y, p.z};
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double out = std::max({double(low[k]) - place[k], place[k] - double(high[k]), 0.0});
    sum += out * out;
  }
  return sum;
}

}  // namespace

NearestTriangle::NearestTriangle(const Mesh& mesh, unsigned threads, Pulse* pulse) : pulse_(pulse) {
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& f = mesh.triangles[t];
    const Vec3 &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    if (!has_area(a, b, c)) continue;
    const Vec3 n = cross(b - a, c - a);
    const double length = std::sqrt(dot(n, n));
    corners_.push_back({a, b, c, {n.x / length, n.y / length, n.z / length}, t});
  }
  if (corners_.empty()) return;
  const auto count = std::uint32_t(corners_.size());
  nodes_.resize(nodes_of(count));
  // This thread builds the top of the tree, all threads build what is below.
  std::vector<std::array<std::uint32_t, 3>> later;
  build(0, 0, count, std::max(count / 32, 1024u), &later);
  sched::parallel_for(later.size(), threads, [&](std::size_t i) {
    build(later[i][0], later[i][1], later[i][2], 0, nullptr);
  });
}

void NearestTriangle::fit(Node& node) const {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    for (const Vec3* v : {&corners_[i].a, &corners_[i].b, &corners_[i].c}) {
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], component(*v, k));
        high[k] = std::max(high[k], component(*v, k));
      }
    }
  }
  for (int k = 0; k < 3; ++k) node.low[k] = down(low[k]), node.high[k] = up(high[k]);
}

// Puts parts of at most `stop` triangles into `later` instead of building them.
void NearestTriangle::build(std::uint32_t at, std::uint32_t first, std::uint32_t count,
                            std::uint32_t stop, std::vector<std::array<std::uint32_t, 3>>* later) {
  if (later && count <= stop) {
    later->push_back({at, first, count});
    return;
  }
  Node& node = nodes_[at];
  node.first = first, node.count = count, node.second = 0;
  fit(node);
  if (count <= leaf_size || !alive(pulse_)) return;
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (node.high[k] - node.low[k] > node.high[axis] - node.low[axis]) axis = k;
  }
  const auto middle = [axis](const Corners& t) {
    return component(t.a, axis) + component(t.b, axis) + component(t.c, axis);
  };
  const auto begin = corners_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count,
                   [&](const Corners& s, const Corners& t) {
                     const double a = middle(s), b = middle(t);
                     return a != b ? a < b : s.triangle < t.triangle;
                   });
  node.second = at + 1 + nodes_of(count / 2);
  build(at + 1, first, count / 2, stop, later);
  build(node.second, first + count / 2, count - count / 2, stop, later);
}

NearTriangle NearestTriangle::operator()(const Vec3& place, double within) const {
  struct Later {
    std::uint32_t node;
    double distance2;
  };
  NearTriangle best;
  best.distance2 = within * within;
  if (nodes_.empty()) return best;
  Later stack[64];  // the balanced tree is at most 32 deep
  int waiting = 0;
  stack[waiting++] = {0, 0};
  while (waiting > 0) {
    const Later next = stack[--waiting];
    if (next.distance2 > best.distance2) continue;
    const Node& node = nodes_[next.node];
    if (node.second == 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Corners& t = corners_[i];
        const double height = dot(place - t.a, t.normal);  // the factor below allows for rounding
        if (height * height * (1 - 1e-9) > best.distance2) continue;
        const Vec3 q = nearest_on_triangle(place, t.a, t.b, t.c, t.normal), d = q - place;
        const double d2 = dot(d, d);
        const bool nearer =
            d2 < best.distance2 ||
            (d2 == best.distance2 && t.triangle < best.triangle && best.triangle != UINT32_MAX);
        if (nearer) best = {t.triangle, q, d2};
      }
      continue;
    }
    const Node &one = nodes_[next.node + 1], &two = nodes_[node.second];
    const Later a{next.node + 1, box_distance2(one.low, one.high, place)};
    const Later b{node.second, box_distance2(two.low, two.high, place)};
    stack[waiting++] = a.distance2 <= b.distance2 ? b : a;
    stack[waiting++] = a.distance2 <= b.distance2 ? a : b;
  }
  return best;
}

}  // namespace h6::io
