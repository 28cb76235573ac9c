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

using Point = std::array<std::int64_t, 3>;           // tile-local, 2^-18 voxel

std::int64_t floor_voxel(std::int64_t v) { return v >> kFraction; }
std::int64_t ceil_voxel(std::int64_t v) { return -((-v) >> kFraction); }

// The node at or before a hit, and whether it is the hit.
struct Hit {
  std::int64_t node;
  bool exact;
};

// The mean of p, weighted by shares of an area > 0, none negative. In double that is right to 1e-11
// of a voxel; where it is that close to a node, the division is done without error.
Hit locate(const std::int64_t (&share)[3], const std::int64_t (&p)[3], std::int64_t area,
           double scale) {
  const double at = (double(share[0]) * double(p[0]) + double(share[1]) * double(p[1]) +
                     double(share[2]) * double(p[2])) * scale;
  const double node = std::floor(at), rest = at - node;
  if (rest > 1e-9 && rest < 1 - 1e-9) return {std::int64_t(node), false};
  const Wide numerator = Wide(share[0]) * p[0] + Wide(share[1]) * p[1] + Wide(share[2]) * p[2];
  const Wide whole = Wide(area) << kFraction;
  Wide quotient = numerator / whole, remainder = numerator % whole;
  if (remainder < 0) --quotient;
  return {std::int64_t(quotient), remainder == 0};
}

// The bricks of a tile that have rows.
struct Rows {
  std::array<std::int32_t, 64> row;  // or -1
  std::array<std::int64_t, 3> last;  // node that is in the tile and in the grid
};

// Lines along `axis` through nodes (j, k) of the other two axes.
void draw(const Point (&p)[3], std::size_t axis, const Rows& rows,
          std::vector<Crossing>& crossing) {
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::int64_t area = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) -
                      (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
  if (area == 0) return;
  const std::int64_t turn = area > 0 ? 1 : -1;
  area *= turn;
  const auto range = [&](std::size_t k) {
    return std::pair{std::max<std::int64_t>(0, ceil_voxel(std::min({p[0][k], p[1][k], p[2][k]}))),
                     std::min(rows.last[k], floor_voxel(std::max({p[0][k], p[1][k], p[2][k]})))};
  };
  const auto [j0, j1] = range(u);
  const auto [k0, k1] = range(v);
  if (j0 > j1 || k0 > k1) return;
  const double scale = 1 / (double(area) * double(kVoxel));
  const std::int64_t along[3] = {p[0][axis], p[1][axis], p[2][axis]};
  std::int64_t start[3], per_j[3], per_k[3];  // barycentric, times area
  for (std::size_t i = 0; i < 3; ++i) {
    const Point &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
    const std::int64_t du = turn * (b[u] - a[u]), dv = turn * (b[v] - a[v]);
    start[i] = du * (k0 * kVoxel - a[v]) - dv * (j0 * kVoxel - a[u]);
    per_j[i] = -dv * kVoxel;
    per_k[i] = du * kVoxel;
  }
  for (std::int64_t k = k0; k <= k1; ++k) {
    std::int64_t share[3] = {start[0], start[1], start[2]};
    for (std::size_t i = 0; i < 3; ++i) start[i] += per_k[i];
    for (std::int64_t j = j0; j <= j1;
         ++j, share[0] += per_j[0], share[1] += per_j[1], share[2] += per_j[2]) {
      if ((share[0] | share[1] | share[2]) < 0) continue;
      const Hit hit = locate(share, along, area, scale);
      if (hit.node < 0 || hit.node > rows.last[axis]) continue;
      std::array<std::size_t, 3> at;
      at[axis] = std::size_t(hit.node);
      at[u] = std::size_t(j);
      at[v] = std::size_t(k);
      const std::int32_t r = rows.row[(at[2] / 8 * 4 + at[1] / 8) * 4 + at[0] / 8];
      if (r < 0) continue;
      const std::size_t node = (at[2] % 8 * 8 + at[1] % 8) * 8 + at[0] % 8;
      Crossing& there = crossing[std::size_t(r)];
      (hit.exact ? there.on : there.edge[axis]).set(node);
    }
  }
}

}  // namespace

void cross_tile(const Surface& surface, const Grid& grid, std::size_t tile, NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  if (tiles.first[tile] == tiles.first[tile + 1]) return;
  const std::array<int, 3> first = tiles.first_brick(tile);
  Rows rows;
  for (std::size_t k = 0; k < 3; ++k)
    rows.last[k] = 8 * std::min(kernels::kTileBricks, grid.bricks[k] - first[k]) - 1;
  for (int b = 0; b < 64; ++b) {
    const int at[3] = {first[0] + b % 4, first[1] + b / 4 % 4, first[2] + b / 16};
    const bool there = at[0] < grid.bricks[0] && at[1] < grid.bricks[1] && at[2] < grid.bricks[2];
    rows.row[std::size_t(b)] = there ? band.row[grid.cell(at[0], at[1], at[2])] : -1;
  }
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) {
    const auto& triangle = surface.triangles[tiles.triangle[i]];
    double at[3][3];
    bool meets = true;  // with its box, a voxel larger: many triangles are only near
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 3; ++c) {
        const Vec3& v = surface.vertices[triangle[c]];
        at[c][k] = k == 0 ? v.x : k == 1 ? v.y : v.z;
      }
      const double low = 8.0 * first[k];
      meets &= std::max({at[0][k], at[1][k], at[2][k]}) >= low - 1 &&
               std::min({at[0][k], at[1][k], at[2][k]}) <= low + double(rows.last[k]) + 2;
    }
    if (!meets) continue;
    Point p[3];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        p[c][k] = std::llround(at[c][k] * double(kVoxel)) - 8 * first[k] * kVoxel;
    for (std::size_t axis = 0; axis < 3; ++axis) draw(p, axis, rows, band.crossing);
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
