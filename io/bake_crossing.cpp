// bake_crossing.cpp - which edges between neighbouring nodes the surface crosses, exactly.
//
// Vertices are rounded once to 2^-18 voxel: a closed mesh stays closed, and from then on everything
// is integer arithmetic without error. Each triangle is drawn, once along each axis, onto the
// lattice lines inside its projection, BORDER INCLUDED: a line through an edge or a vertex meets
// the faces on both sides of it, so nothing slips through. Triangles parallel to a line need not be
// looked at: where a closed surface parts two sides, a face that is not parallel touches the same
// point. A line that meets a face exactly at a node puts that node ON the surface.
#include <algorithm>

#include "io/bake_grid.h"

namespace h6::io::bake {
namespace {

constexpr int kFraction = 18;                        // bits of a voxel; 2048 voxels: 29 bits
constexpr std::int64_t kVoxel = std::int64_t{1} << kFraction;
__extension__ typedef __int128 Wide;

using Point = std::array<std::int64_t, 3>;           // brick-local, 2^-18 voxel

std::int64_t floor_voxel(std::int64_t v) { return v >> kFraction; }
std::int64_t ceil_voxel(std::int64_t v) { return -((-v) >> kFraction); }

// numerator / (2^18 * area), area > 0: the node at or before the hit, and whether it is the hit.
struct Hit {
  std::int64_t node;
  bool exact;
};
Hit locate(Wide numerator, std::int64_t area) {
  const double at = double(numerator) / (double(area) * double(kVoxel));
  const double node = std::floor(at), rest = at - node;
  if (rest > 1e-9 && rest < 1 - 1e-9 && std::fabs(at) < 1e5) return {std::int64_t(node), false};
  const Wide whole = Wide(area) << kFraction;
  Wide quotient = numerator / whole, remainder = numerator % whole;
  if (remainder < 0) --quotient;
  return {std::int64_t(quotient), remainder == 0};
}

std::size_t node_index(std::size_t axis, std::int64_t along, std::int64_t j, std::int64_t k) {
  std::array<std::int64_t, 3> c{};
  c[axis] = along;
  c[(axis + 1) % 3] = j;
  c[(axis + 2) % 3] = k;
  return std::size_t((c[2] * 8 + c[1]) * 8 + c[0]);
}

// Lines along `axis` through nodes (j, k) of the other two axes.
void draw(const Point (&p)[3], std::size_t axis, Crossing& crossing) {
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::int64_t area = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) -
                      (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
  if (area == 0) return;
  const std::int64_t turn = area > 0 ? 1 : -1;
  area *= turn;
  const auto range = [&](std::size_t k) {
    return std::pair{std::max<std::int64_t>(0, ceil_voxel(std::min({p[0][k], p[1][k], p[2][k]}))),
                     std::min<std::int64_t>(7, floor_voxel(std::max({p[0][k], p[1][k], p[2][k]})))};
  };
  const auto [j0, j1] = range(u);
  const auto [k0, k1] = range(v);
  for (std::int64_t k = k0; k <= k1; ++k)
    for (std::int64_t j = j0; j <= j1; ++j) {
      const std::int64_t y = j * kVoxel, z = k * kVoxel;
      std::int64_t share[3];  // barycentric, times area
      bool inside = true;
      for (std::size_t i = 0; i < 3 && inside; ++i) {
        const Point &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
        share[i] = turn * ((b[u] - a[u]) * (z - a[v]) - (b[v] - a[v]) * (y - a[u]));
        inside = share[i] >= 0;
      }
      if (!inside) continue;
      const Hit hit = locate(Wide(share[0]) * p[0][axis] + Wide(share[1]) * p[1][axis] +
                                 Wide(share[2]) * p[2][axis],
                             area);
      if (hit.node < 0 || hit.node > 7) continue;
      const std::size_t node = node_index(axis, hit.node, j, k);
      if (hit.exact)
        crossing.on.set(node);
      else
        crossing.edge[axis].set(node);
    }
}

}  // namespace

void cross_row(const Surface& surface, const Grid& grid, std::size_t row, NarrowBand& band) {
  Crossing& crossing = band.crossing[row];
  const std::array<int, 3> place = grid.place(band.cell[row]);
  for (std::size_t at = band.first[row]; at < band.first[row + 1]; ++at) {
    Point p[3];
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& vertex = surface.vertices[surface.triangles[band.triangle[at]][i]];
      const double c[3] = {vertex.x, vertex.y, vertex.z};
      for (std::size_t k = 0; k < 3; ++k)
        p[i][k] = std::llround(c[k] * double(kVoxel)) - 8 * place[k] * kVoxel;
    }
    bool apart = false;
    for (std::size_t k = 0; k < 3; ++k)
      apart |= std::max({p[0][k], p[1][k], p[2][k]}) < 0 ||
               std::min({p[0][k], p[1][k], p[2][k]}) > 8 * kVoxel;
    if (apart) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) draw(p, axis, crossing);
  }
}

}  // namespace h6::io::bake
