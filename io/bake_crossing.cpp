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

void cross_tile(const Surface& surface, const Grid& grid, std::size_t tile, NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  const std::array<int, 3> first = tiles.first_brick(tile);
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) {
    Point p[3];  // tile-local
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3& vertex = surface.vertices[surface.triangles[tiles.triangle[i]][c]];
      const double at[3] = {vertex.x, vertex.y, vertex.z};
      for (std::size_t k = 0; k < 3; ++k)
        p[c][k] = std::llround(at[k] * double(kVoxel)) - 8 * first[k] * kVoxel;
    }
    int low[3], high[3];  // bricks the box meets; a brick's edges run from node 0 to node 8
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [least, most] = std::minmax({p[0][k], p[1][k], p[2][k]});
      low[k] = int(std::max<std::int64_t>(0, (least + 8 * kVoxel - 1) / (8 * kVoxel) - 1));
      high[k] = int(std::min<std::int64_t>(3, most < 0 ? -1 : most / (8 * kVoxel)));
      high[k] = std::min(high[k], grid.bricks[k] - 1 - first[k]);
    }
    for (int c = low[2]; c <= high[2]; ++c)
      for (int b = low[1]; b <= high[1]; ++b)
        for (int a = low[0]; a <= high[0]; ++a) {
          const std::int32_t r = band.row[grid.cell(first[0] + a, first[1] + b, first[2] + c)];
          if (r < 0) continue;
          const std::array<std::int64_t, 3> by = {8 * a * kVoxel, 8 * b * kVoxel, 8 * c * kVoxel};
          Point q[3];
          for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t k = 0; k < 3; ++k) q[corner][k] = p[corner][k] - by[k];
          for (std::size_t axis = 0; axis < 3; ++axis)
            draw(q, axis, band.crossing[std::size_t(r)]);
        }
  }
  const std::array<int, 3> end = {std::min(first[0] + 4, int(grid.bricks[0])),
                                  std::min(first[1] + 4, int(grid.bricks[1])),
                                  std::min(first[2] + 4, int(grid.bricks[2]))};
  for (int c = first[2]; c < end[2]; ++c)
    for (int b = first[1]; b < end[1]; ++b)
      for (int a = first[0]; a < end[0]; ++a) {
        const std::int32_t r = band.row[grid.cell(a, b, c)];
        if (r < 0) continue;
        for (std::size_t z = 0; z < 8; ++z)
          band.free[std::size_t(r)].z[z] &= ~band.crossing[std::size_t(r)].on.z[z];
      }
}

}  // namespace h6::io::bake
