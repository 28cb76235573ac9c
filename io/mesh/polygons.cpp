// SPDX-License-Identifier: Apache-2.0
// polygons.cpp - cuts faces into triangles, and welds; all formats but STL use it.
#include <cmath>
#include <span>

#include "io/mesh/formats.h"
#include "io/mesh/weld.h"

namespace h6::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Loop = std::span<const std::uint32_t>;

struct Flat {
  double u, v;
};

// Positive when a, b, c turn left.
double turn(const Flat& a, const Flat& b, const Flat& c) {
  return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

// The loop projected along the axis nearest to its normal (Newell's method), counter-clockwise.
// Faces are nearly flat; the projection of others is cut just the same.
std::vector<Flat> flatten(const std::vector<Vec3>& points, Loop loop) {
  const Vec3 base = points[loop[0]];  // far from the origin, products would lose all digits
  double nx = 0, ny = 0, nz = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 &p = points[loop[i]], &q = points[loop[(i + 1) % loop.size()]];
    nx += (p.y - q.y) * (p.z + q.z - 2 * base.z);
    ny += (p.z - q.z) * (p.x + q.x - 2 * base.x);
    nz += (p.x - q.x) * (p.y + q.y - 2 * base.y);
  }
  const double ax = std::abs(nx), ay = std::abs(ny), az = std::abs(nz);
  std::vector<Flat> flat;
  flat.reserve(loop.size());
  for (const std::uint32_t index : loop) {
    const Vec3 p = points[index] - base;
    Flat f{};
    if (az >= ax && az >= ay)
      f = nz >= 0 ? Flat{p.x, p.y} : Flat{p.y, p.x};
    else if (ax >= ay)
      f = nx >= 0 ? Flat{p.y, p.z} : Flat{p.z, p.y};
    else
      f = ny >= 0 ? Flat{p.z, p.x} : Flat{p.x, p.z};
    flat.push_back(f);
  }
  return flat;
}

void add_fan(Loop loop, std::size_t from, std::vector<Triangle>& out) {
  const std::size_t n = loop.size();
  for (std::size_t i = 1; i + 1 < n; ++i)
    out.push_back({loop[from], loop[(from + i) % n], loop[(from + i + 1) % n]});
}

// Whether all triangles of the fan have the same winding: then they cover the face once.
bool is_fan(const std::vector<Flat>& flat, std::size_t from) {
  const std::size_t n = flat.size();  // 0 for a triangle
  for (std::size_t i = 1; i + 1 < n; ++i)
    if (turn(flat[from], flat[(from + i) % n], flat[(from + i + 1) % n]) < 0) return false;
  return true;
}

// Cuts off one ear after the other: a convex corner whose triangle holds no other corner. This is
// quadratic in the number of corners, cubic at worst. False when `budget`, counted in corners
// visited, is used up.
bool clip_ears(Loop loop, const std::vector<Flat>& flat, std::uint64_t& budget,
               std::vector<Triangle>& out) {
  std::vector<std::uint32_t> left(loop.size());
  for (std::uint32_t i = 0; i < left.size(); ++i) left[i] = i;
  const auto is_ear = [&](std::size_t at) {
    const std::size_t n = left.size();
    const std::uint32_t ia = left[(at + n - 1) % n], ib = left[at], ic = left[(at + 1) % n];
    const Flat &a = flat[ia], &b = flat[ib], &c = flat[ic];
    if (!(turn(a, b, c) > 0)) return false;
    for (const std::uint32_t i : left) {
      const Flat& p = flat[i];
      // A bridge to a hole passes a place twice: the twin of a corner does not block its ear.
      if ((p.u == a.u && p.v == a.v) || (p.u == b.u && p.v == b.v) || (p.u == c.u && p.v == c.v))
        continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  };
  std::size_t at = 0, tried = 0;
  while (left.size() > 3 && tried <= left.size()) {
    const std::size_t n = left.size();
    if (budget < n) return false;
    budget -= n;
    at %= n;
    ++tried;
    if (!is_ear(at)) {
      ++at;
      continue;
    }
    out.push_back({loop[left[(at + n - 1) % n]], loop[left[at]], loop[left[(at + 1) % n]]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    tried = 0;
  }
  // More than three are left when the face crosses itself or has no area: no cut is right then.
  for (std::size_t i = 1; i + 1 < left.size(); ++i)
    out.push_back({loop[left[0]], loop[left[i]], loop[left[i + 1]]});
  return true;
}

bool triangulate(const std::vector<Vec3>& points, Loop loop, std::uint64_t& budget,
                 std::vector<Triangle>& out) {
  const std::vector<Flat> flat = loop.size() > 3 ? flatten(points, loop) : std::vector<Flat>{};
  for (std::size_t from = 0; from < 2; ++from) {  // one of the two is right for every simple quad
    if (!is_fan(flat, from)) continue;
    add_fan(loop, from, out);
    return true;
  }
  return clip_ears(loop, flat, budget, out);
}

}  // namespace

Mesh assemble(Polygons&& polygons, const MeshSource& source) {
  // About half a second and the time of reading the file: enough for a concave face of thousands of
  // corners, or for any number of small ones.
  std::uint64_t budget = 200'000'000 + 200 * std::uint64_t{polygons.corners.size()};
  Mesh mesh;
  mesh.part_names = std::move(polygons.part_names);
  mesh.triangles.reserve(polygons.corners.size() - 2 * polygons.sizes.size());
  const bool parts = mesh.part_names.size() > 1;
  std::size_t first = 0;
  for (std::size_t face = 0; face < polygons.sizes.size(); ++face) {
    const Loop loop = Loop(polygons.corners).subspan(first, polygons.sizes[face]);
    if (!triangulate(polygons.points, loop, budget, mesh.triangles))
      source.fail("face " + std::to_string(face + 1),
                  "its concave faces take too long to cut into triangles; export it as triangles");
    if (parts) mesh.part.resize(mesh.triangles.size(), polygons.part[face]);
    first += polygons.sizes[face];
  }
  mesh.vertices = std::move(polygons.points);
  return weld(mesh);
}

}  // namespace h6::io
