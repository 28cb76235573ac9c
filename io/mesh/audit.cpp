// SPDX-License-Identifier: Apache-2.0
// audit.cpp - counts the defects of a mesh. It sorts instead of using maps, which takes half a
// second for millions of triangles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "io/mesh/mesh.h"

namespace h6::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

double largest(const Vec3& a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }

bool collapsed(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// Whether the area is no more than rounding: three points on a line, scaled from millimetres, leave
// it by about 1e-16 of their distance from the origin.
bool has_no_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const double longest = std::sqrt(std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)}));
  const double reach = std::max({largest(a), largest(b), largest(c)});
  const Vec3 n = cross(ab, ac);
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  return std::sqrt(dot(n, n)) <= kRounding * longest * reach;
}

std::size_t count_degenerate(const Mesh& mesh) {
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
        return collapsed(t) ||
               has_no_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
      }));
}

// The first triangle of each set of three vertices, in order.
std::vector<Triangle> drop_duplicates(const Mesh& mesh) {
  struct Key {
    std::uint64_t low_two;  // smallest vertex in the upper half, middle one in the lower
    std::uint32_t high, index;
    bool operator<(const Key& o) const {
      if (low_two != o.low_two) return low_two < o.low_two;
      return high != o.high ? high < o.high : index < o.index;
    }
    bool same_vertices(const Key& o) const { return low_two == o.low_two && high == o.high; }
  };
  std::vector<Key> keys(mesh.triangles.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    Triangle t = mesh.triangles[i];
    std::sort(t.begin(), t.end());
    keys[i] = {std::uint64_t{t[0]} << 32 | t[1], t[2], i};
  }
  std::sort(keys.begin(), keys.end());

  std::vector<bool> duplicate(keys.size());
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].same_vertices(keys[i - 1])) duplicate[keys[i].index] = true;
  std::vector<Triangle> kept;
  kept.reserve(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (!duplicate[i]) kept.push_back(mesh.triangles[i]);
  return kept;
}

void count_edges(const std::vector<Triangle>& triangles, MeshAudit& out) {
  // An edge is one integer: the smaller vertex, the larger one, and its direction in the lowest
  // bit. Vertex numbers are below 2^31, since as many vertices would be 50 GB.
  std::vector<std::uint64_t> edges;
  edges.reserve(triangles.size() * 3);
  for (const Triangle& t : triangles) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint64_t a = t[corner], b = t[(corner + 1) % 3];
      edges.push_back(std::min(a, b) << 33 | std::max(a, b) << 1 | (a < b ? 1 : 0));
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i, up = 0;
    for (; end < edges.size() && edges[end] >> 1 == edges[i] >> 1; ++end) up += edges[end] & 1;
    const std::size_t faces = end - i;
    out.open_edges += faces == 1;
    out.nonmanifold_edges += faces > 2;
    out.odd_edges += faces % 2;
    out.flipped_edges += faces == 2 && up != 1;
    i = end;
  }
}

std::size_t count_components(const std::vector<Triangle>& triangles, std::size_t vertices) {
  std::vector<std::uint32_t> parent(vertices);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<bool> used(vertices);
  std::size_t count = 0;
  const auto enter = [&](std::uint32_t v) {
    if (!used[v]) ++count;
    used[v] = true;
  };
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) enter(v);
    for (int corner = 1; corner < 3; ++corner) {
      const std::uint32_t a = root(t[0]), b = root(t[corner]);
      if (a == b) continue;
      parent[std::max(a, b)] = std::min(a, b);
      --count;
    }
  }
  return count;
}

void measure_box(const Mesh& mesh, MeshAudit& out) {
  if (mesh.vertices.empty()) return;
  out.low = out.high = mesh.vertices.front();
  for (const Vec3& p : mesh.vertices) {
    out.low = min(out.low, p);
    out.high = max(out.high, p);
  }
}

// By the divergence theorem, about the middle of the box: about the origin, the volume of a small
// part far away would be a difference of large numbers.
double signed_volume(const Mesh& mesh, const std::vector<Triangle>& triangles, const Vec3& low,
                     const Vec3& high) {
  const Vec3 middle = {(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2};
  double six_volumes = 0;
  for (const Triangle& t : triangles) {
    const Vec3 a = mesh.vertices[t[0]] - middle, b = mesh.vertices[t[1]] - middle,
               c = mesh.vertices[t[2]] - middle;
    six_volumes += dot(a, cross(b, c));
  }
  return six_volumes / 6;
}

}  // namespace

MeshAudit audit(const Mesh& mesh) {
  const Mesh welded = weld(mesh);
  MeshAudit out;
  out.triangles = welded.triangles.size();
  out.vertices = welded.vertices.size();
  out.degenerate = count_degenerate(welded);

  std::vector<Triangle> kept = drop_duplicates(welded);
  out.duplicates = out.triangles - kept.size();
  std::erase_if(kept, collapsed);
  count_edges(kept, out);
  out.components = count_components(kept, welded.vertices.size());
  out.closed = out.odd_edges == 0 && out.degenerate < out.triangles;

  measure_box(welded, out);
  out.volume = signed_volume(welded, kept, out.low, out.high);
  return out;
}

}  // namespace h6::io
