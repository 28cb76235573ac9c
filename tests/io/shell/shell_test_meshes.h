// SPDX-License-Identifier: Apache-2.0
// shell_test_meshes.h - closed bodies with known surface and inside, and checks of a sphere tree
// that share no code with the bake.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "io/mesh/mesh.h"
#include "io/shell/shell_data.h"

namespace shells {

using h6::io::Mesh;
using h6::io::ShellData;
using h6::io::Vec3;
using namespace h6;  // vectors
constexpr double pi = 3.14159265358979323846;

inline Vec3 point(const ShellData& s, std::size_t i) { return {s.x[i], s.y[i], s.z[i]}; }
inline Vec3 normal(const ShellData& s, std::size_t i) { return {s.nx[i], s.ny[i], s.nz[i]}; }

// A quad grid rolled up along u and, if asked, along v; counter-clockwise seen from outside when
// du x dv points out.
template <class Place>
Mesh rolled(std::uint32_t nu, std::uint32_t nv, const Place& place) {
  Mesh mesh;
  for (std::uint32_t v = 0; v < nv; ++v) {
    for (std::uint32_t u = 0; u < nu; ++u) mesh.vertices.push_back(place(u, v));
  }
  for (std::uint32_t v = 0; v < nv; ++v) {
    for (std::uint32_t u = 0; u < nu; ++u) {
      const std::uint32_t a = v * nu + u, b = v * nu + (u + 1) % nu,
                          c = ((v + 1) % nv) * nu + (u + 1) % nu, d = ((v + 1) % nv) * nu + u;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

inline Mesh torus(double major, double minor, std::uint32_t nu = 96, std::uint32_t nv = 48) {
  return rolled(nu, nv, [=](std::uint32_t u, std::uint32_t v) {
    const double a = 2 * pi * u / nu, b = 2 * pi * v / nv, r = major + minor * std::cos(b);
    return Vec3{r * std::cos(a), r * std::sin(a), minor * std::sin(b)};
  });
}

// Latitude and longitude; the poles are rings of zero radius, welded by equal coordinates.
inline Mesh sphere(double radius, std::uint32_t rings = 96) {
  Mesh mesh;
  const std::uint32_t nu = 2 * rings;
  for (std::uint32_t v = 0; v <= rings; ++v) {
    const double b = pi * v / rings - pi / 2;
    const bool pole = v == 0 || v == rings;
    for (std::uint32_t u = 0; u < nu; ++u) {
      const double a = 2 * pi * u / nu, r = pole ? 0 : radius * std::cos(b);
      mesh.vertices.push_back({r * std::cos(a) + 0.0, r * std::sin(a) + 0.0, radius * std::sin(b)});
    }
  }
  for (std::uint32_t v = 0; v < rings; ++v) {
    for (std::uint32_t u = 0; u < nu; ++u) {
      const std::uint32_t a = v * nu + u, b = v * nu + (u + 1) % nu, c = b + nu, d = a + nu;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

inline Mesh box(const Vec3& low, const Vec3& high) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back(
        {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  }
  constexpr std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

inline void add(Mesh& mesh, const Mesh& other) {
  const auto first = std::uint32_t(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

inline Mesh inside_out(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

// Least and mean distance to the nearest other point among the first `count`. `one_side`: counts
// only points whose normals are less than 134 degrees apart, since the sides of a sheet are sampled
// separately.
struct Spacing {
  double least = INFINITY, mean = 0;
};
inline Spacing spacing(const ShellData& s, std::size_t count, bool one_side = false) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return s.x[a] < s.x[b]; });
  Spacing out;
  double found = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = point(s, order[i]);
    double best = INFINITY;
    const auto look = [&](std::size_t k) {
      const Vec3 d = point(s, order[k]) - p;
      if (d.x * d.x > best) return false;
      if (!one_side || dot(normal(s, order[k]), normal(s, order[i])) > -0.694)
        best = std::min(best, dot(d, d));
      return true;
    };
    for (std::size_t k = i + 1; k < count && look(k); ++k) {
    }
    for (std::size_t k = i; k > 0 && look(k - 1); --k) {
    }
    if (std::isinf(best)) continue;  // alone on its side
    out.least = std::min(out.least, std::sqrt(best));
    out.mean += std::sqrt(best);
    ++found;
  }
  out.mean /= std::max(1.0, found);
  return out;
}

// The first promise of h6ShellDef that the shell breaks; empty: none.
inline const char* broken_promise(const ShellData& s) {
  const std::size_t levels = s.level_points.size();
  if (s.level_first.size() != levels + 1 || levels == 0 || s.level_first[0] != 0)
    return "level table";
  if (s.level_points.back() != s.size()) return "the last level is all points";
  for (std::size_t k = 0; k < levels; ++k) {
    std::vector<std::uint32_t> here(s.node_point.begin() + s.level_first[k],
                                    s.node_point.begin() + s.level_first[k + 1]);
    if (here.size() != s.level_points[k]) return "rows of a level";
    std::sort(here.begin(), here.end());  // nested: a level is a prefix of the points
    for (std::uint32_t i = 0; i < here.size(); ++i) {
      if (here[i] != i) return "a level is the first points, each once";
    }
  }
  // Descendants by following children down, level by level.
  for (std::size_t k = 0; k + 1 < levels; ++k) {
    std::vector<int> parents(s.level_points[k + 1], 0);
    for (std::size_t r = s.level_first[k]; r < s.level_first[k + 1]; ++r) {
      const std::size_t first = s.node_first_child[r], count = s.node_child_count[r];
      if (count == 0 || first < s.level_first[k + 1] || first + count > s.level_first[k + 2]) {
        return "children are on the next level";
      }
      if (s.node_point[first] != s.node_point[r]) return "a node is its own first child";
      for (std::size_t c = first; c < first + count; ++c) ++parents[c - s.level_first[k + 1]];
      std::size_t low = r, high = r + 1;  // rows of descendants, one level after the other
      for (std::size_t deep = k; deep + 1 < levels; ++deep) {
        const std::size_t next = s.node_first_child[low];
        high = s.node_first_child[high - 1] + s.node_child_count[high - 1];
        low = next;
        for (std::size_t d = low; d < high; ++d) {
          const std::uint32_t a = s.node_point[r], b = s.node_point[d];
          const float x = s.x[a] - s.x[b], y = s.y[a] - s.y[b], z = s.z[a] - s.z[b];
          const float one = std::sqrt(x * x + y * y + z * z);
          const float other = std::sqrt(std::fma(z, z, std::fma(y, y, x * x)));
          if (one > s.node_radius[r] || other > s.node_radius[r])
            return "a sphere holds its descendants";
        }
      }
    }
    if (std::any_of(parents.begin(), parents.end(), [](int n) { return n != 1; })) {
      return "every row has one parent";
    }
  }
  for (std::size_t r = s.level_first[levels - 1]; r < s.node_point.size(); ++r) {
    if (s.node_radius[r] != 0 || s.node_child_count[r] != 0 || s.node_first_child[r] != 0) {
      return "the last level has no children and no radius";
    }
  }
  return "";
}

inline bool same_bits(const ShellData& a, const ShellData& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.nx == b.nx && a.ny == b.ny && a.nz == b.nz &&
         a.source == b.source && a.level_points == b.level_points &&
         a.level_first == b.level_first && a.node_point == b.node_point &&
         a.node_first_child == b.node_first_child && a.node_child_count == b.node_child_count &&
         a.node_radius == b.node_radius && a.input_hash == b.input_hash;
}

}  // namespace shells
