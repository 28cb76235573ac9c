// SPDX-License-Identifier: Apache-2.0
#include "io/scenes/paper/experiment_shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace h6::io {
namespace {

std::uint32_t add_vertex(Mesh& mesh, double x, double y, double z) {
  mesh.vertices.push_back({x, y, z});
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

}  // namespace

int Sampler::along(int cells) const {
  return std::max(1, static_cast<int>(std::lround(cells * std::sqrt(sampling_.density))));
}
double Sampler::spacing(double figure) const { return figure / std::sqrt(sampling_.density); }
int Sampler::count(int figure) const {
  return std::max(1, static_cast<int>(std::lround(figure * sampling_.density)));
}
double Sampler::unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

void Sampler::face(PointCloud& cloud, const h6Vec3& centre, const h6Vec3& u, const h6Vec3& v,
                   int nu, int nv, const h6Vec3& inward) {
  const int rows = along(nu), columns = along(nv);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double a = 2 * in_cell(i) / rows - 1, b = 2 * in_cell(j) / columns - 1;
      add_shell_point(cloud, centre + a * u + b * v, inward);
    }
}

void add_shell_point(PointCloud& cloud, const h6Vec3& p, const h6Vec3& inward) {
  cloud.x.push_back(static_cast<float>(p.x));
  cloud.y.push_back(static_cast<float>(p.y));
  cloud.z.push_back(static_cast<float>(p.z));
  cloud.nx.push_back(static_cast<float>(inward.x));
  cloud.ny.push_back(static_cast<float>(inward.y));
  cloud.nz.push_back(static_cast<float>(inward.z));
}

Mesh prism_mesh(const h6Vec3& centre, double radius, double low, double high, int segments) {
  Mesh mesh;
  const double corner = radius / std::cos(std::numbers::pi / segments);
  for (const double z : {low, high})
    for (int i = 0; i < segments; ++i) {
      const double angle = 2 * std::numbers::pi * i / segments;
      add_vertex(mesh, centre.x + corner * std::cos(angle), centre.y + corner * std::sin(angle),
                 centre.z + z);
    }
  const std::uint32_t bottom = add_vertex(mesh, centre.x, centre.y, centre.z + low);
  const std::uint32_t top = add_vertex(mesh, centre.x, centre.y, centre.z + high);
  const auto n = static_cast<std::uint32_t>(segments);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    mesh.triangles.push_back({bottom, j, i});
    mesh.triangles.push_back({top, n + i, n + j});
  }
  return mesh;
}

Mesh plate_with_wire(double side, double thickness, double x, double height, double radius,
                     int segments) {
  // The outline in the xz plane, counter-clockwise seen from -y (x right, z up): bottom left,
  // bottom right, top right, the wire's arc from its right foot over the top to its left foot, top
  // left.
  struct P {
    double x, z;
  };
  std::vector<P> outline = {{-side, -thickness}, {side, -thickness}, {side, 0}};
  const double foot = std::asin(-height / radius);  // angle of the right foot above +x
  for (int i = 0; i <= segments; ++i) {
    const double angle = foot + (std::numbers::pi - 2 * foot) * i / segments;
    // The feet are exactly on the plate, without rounding.
    const double z = i == 0 || i == segments ? 0 : height + radius * std::sin(angle);
    outline.push_back({x + radius * std::cos(angle), z});
  }
  outline.push_back({-side, 0});
  const auto n = static_cast<std::uint32_t>(outline.size());

  Mesh mesh;
  for (const double y : {-side, side})
    for (const P& p : outline) add_vertex(mesh, p.x, y, p.z);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  // Each end has two fans: one over the plate's corners and the feet, one over the convex arc.
  const std::uint32_t right = 3, left = n - 2, corner = n - 1;
  const auto cap = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back({c + n, b + n, a + n});
    mesh.triangles.push_back({a, b, c});
  };
  const auto both = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { cap(a, b, c); };
  both(0, 1, 2);
  both(0, 2, right);
  both(0, right, left);
  both(0, left, corner);
  for (std::uint32_t i = right + 1; i < left; ++i) both(right, i, i + 1 == left ? left : i + 1);
  // The outline is counter-clockwise seen from -y, so the ends are wound outward already. The sides
  // made first are wound inward: turn them.
  for (std::uint32_t t = 0; t < 2 * n; ++t) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  return mesh;
}

Mesh block_with_cavity(double half_side, double height, const std::vector<Ring>& rings,
                       double bottom, int segments) {
  Mesh mesh;
  const auto n = static_cast<std::uint32_t>(segments);
  // As in block_with_hole: every ring has a vertex on each of the same rays.
  const auto ring = [&](double radius, double z, bool square) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int i = 0; i < segments; ++i) {
      const double angle = 2 * std::numbers::pi * i / segments;
      const double c = std::cos(angle), s = std::sin(angle);
      const double r = square ? half_side / std::max(std::abs(c), std::abs(s)) : radius;
      add_vertex(mesh, r * c, r * s, z);
    }
    return first;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      mesh.triangles.push_back({a + i, a + j, b + j});
      mesh.triangles.push_back({a + i, b + j, b + i});
    }
  };
  const auto close = [&](std::uint32_t a, double z, bool up) {
    const std::uint32_t middle = add_vertex(mesh, 0, 0, z);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      mesh.triangles.push_back({middle, a + (up ? i : j), a + (up ? j : i)});
    }
  };
  const std::uint32_t base = ring(0, -height, true), top = ring(0, 0, true);
  std::uint32_t last = top;
  join(base, top);
  for (const Ring& r : rings) {
    const std::uint32_t next = ring(r.r, r.z, false);
    join(last, next);
    last = next;
  }
  close(last, bottom, true);
  close(base, -height, false);
  return mesh;
}

}  // namespace h6::io
