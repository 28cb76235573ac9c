// SPDX-License-Identifier: Apache-2.0
// crossing.cpp - which edges between neighbouring nodes the surface crosses, exactly.
//
// Vertices are rounded once to 2^-18 voxel, which keeps a closed mesh closed; all that follows is
// integer arithmetic without error. Along each axis, a triangle meets the lattice lines inside its
// projection, BORDER INCLUDED: a line through an edge or a vertex meets the faces on both sides, so
// no line slips through. Triangles parallel to a line need no test: where a closed surface
// separates two sides, a face that is not parallel touches the same point. Where a line meets a
// face exactly at a node, the node is ON the surface.
#include <algorithm>

#include "io/bake/grid.h"
#include "kernels/bake/lattice_hits.h"

namespace h6::io::bake {
namespace {

constexpr int kFraction = 18;  // bits after the point; 2048 voxels take 29 bits
constexpr std::int64_t kVoxel = std::int64_t{1} << kFraction;
__extension__ typedef __int128 Wide;

using Point = std::array<std::int64_t, 3>;  // tile-local, 2^-18 voxel

std::int64_t floor_voxel(std::int64_t v) { return v >> kFraction; }
std::int64_t ceil_voxel(std::int64_t v) { return -((-v) >> kFraction); }

// To the nearest 2^-18 voxel. Every triangle at a vertex gets the same.
std::int64_t rounded(double voxels) {
  const double v = voxels * double(kVoxel);
  return std::int64_t(v + std::copysign(0.5, v));
}

// A triangle along an axis: its corners' coordinates, and factors that make a coordinate of the
// barycentric shares of the area.
struct Along {
  std::int64_t corner[3];
  double first, second, third;  // [voxel]; the last two per area
};
Along make_along(const Point (&p)[3], std::size_t axis, std::int64_t area) {
  Along a{{p[0][axis], p[1][axis], p[2][axis]}, 0, 0, 0};
  const double scale = 1 / double(kVoxel), by_area = scale / double(area);
  a.first = double(a.corner[0]) * scale;
  a.second = double(a.corner[1] - a.corner[0]) * by_area;
  a.third = double(a.corner[2] - a.corner[0]) * by_area;
  return a;
}

// The hit of a line on a triangle: the node at or before it, and whether it is exactly at that
// node.
struct Hit {
  std::int64_t node;
  bool exact;
};
// `at` is right to 1e-11 voxel; where that does not decide, integers() does.
template <class Integers>
Hit locate(double at, Integers&& integers) {
  const std::int64_t before = std::int64_t(at) - (at < 0);
  const double rest = at - double(before);
  return rest > 1e-9 && rest < 1 - 1e-9 ? Hit{before, false} : integers();
}
// From the corners' coordinates along the line and their shares > 0 of the area.
Hit locate_exactly(const std::int64_t (&corner)[3], const std::int64_t (&share)[3],
                   std::int64_t area) {
  const Wide numerator =
      Wide(share[0]) * corner[0] + Wide(share[1]) * corner[1] + Wide(share[2]) * corner[2];
  const Wide whole = Wide(area) << kFraction;
  Wide quotient = numerator / whole, remainder = numerator % whole;
  if (remainder < 0) --quotient;
  return {std::int64_t(quotient), remainder == 0};
}

constexpr std::int64_t kSide = 8 * kernels::kTileBricks;  // nodes
static_assert(kSide == kernels::kLatticeSide && kVoxel == std::int64_t(kernels::kLatticeVoxel));

// A tile's rows, by brick.
using Rows = std::array<std::int32_t, 64>;

// Marks that the line along `axis` through nodes (j, k) of the other two axes meets a triangle. The
// edge from a node belongs to the node's brick.
template <std::size_t axis>
void mark(const Hit& hit, std::int64_t j, std::int64_t k, const Rows& rows,
          std::vector<Crossing>& crossings) {
  if (hit.node < 0 || hit.node >= kSide) return;
  std::array<std::size_t, 3> at;
  at[axis] = std::size_t(hit.node);
  at[(axis + 1) % 3] = std::size_t(j);
  at[(axis + 2) % 3] = std::size_t(k);
  const std::int32_t r = rows[(at[2] / 8 * 4 + at[1] / 8) * 4 + at[0] / 8];
  if (r < 0) return;
  const std::size_t node = ((at[2] & 7) * 8 + (at[1] & 7)) * 8 + (at[0] & 7);
  Crossing& c = crossings[std::size_t(r)];
  (hit.exact ? c.on : c.edge[axis]).set(node);
}

// Twice the areas that the line (j, k) makes with each two corners; returns their sum, twice the
// triangle's area.
template <std::size_t axis>
std::int64_t shares(const Point (&p)[3], std::int64_t j, std::int64_t k, std::int64_t (&share)[3]) {
  constexpr std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::int64_t whole = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Point &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
    share[i] = (b[u] - a[u]) * (k * kVoxel - a[v]) - (b[v] - a[v]) * (j * kVoxel - a[u]);
    whole += share[i];
  }
  if (whole < 0)
    for (std::int64_t& part : share) part = -part;
  return std::abs(whole);
}

template <std::size_t axis>
void mark_small(const Point (&p)[3], const kernels::LatticeHits& hits,
                const std::int32_t (&first)[3], const Rows& rows,
                std::vector<Crossing>& crossings) {
  for (std::size_t n = 0; n < hits.count[axis]; ++n) {
    const std::size_t slot = hits.slot[axis][n], shift = hits.shift[axis];
    const std::int64_t j = first[(axis + 1) % 3] + std::int64_t(slot & ((1u << shift) - 1));
    const std::int64_t k = first[(axis + 2) % 3] + std::int64_t(slot >> shift);
    const Hit hit = locate(hits.at[axis][slot], [&] {
      std::int64_t share[3];
      const std::int64_t area = shares<axis>(p, j, k, share);
      return locate_exactly({p[0][axis], p[1][axis], p[2][axis]}, share, area);
    });
    mark<axis>(hit, j, k, rows, crossings);
  }
}

// For triangles too large for the kernel's arithmetic. Which lines meet one is unpredictable, so
// they are listed without branches first.
struct Lines {
  std::int64_t first, last;  // lines that a triangle may meet, along an axis of the tile
};
template <std::size_t axis>
void draw_large(const Point (&p)[3], const std::array<Lines, 3>& lines, const Rows& rows,
                std::vector<Crossing>& crossings) {
  constexpr std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto [j0, j1] = lines[u];
  const auto [k0, k1] = lines[v];
  if (j0 > j1 || k0 > k1) return;
  std::int64_t area =
      (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
  if (area == 0) return;
  const std::int64_t turn = area > 0 ? 1 : -1;
  area *= turn;
  std::int64_t line[3], per_j[3], per_k[3];  // barycentric shares, and their steps
  for (std::size_t i = 0; i < 3; ++i) {
    const Point &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
    const std::int64_t du = turn * (b[u] - a[u]), dv = turn * (b[v] - a[v]);
    line[i] = du * (k0 * kVoxel - a[v]) - dv * (j0 * kVoxel - a[u]);
    per_j[i] = -dv * kVoxel;
    per_k[i] = du * kVoxel;
  }
  std::uint16_t met[kSide * kSide];
  std::size_t count = 0;
  std::int64_t of_row[3] = {line[0], line[1], line[2]};
  for (std::int64_t k = 0; k <= k1 - k0; ++k) {
    std::int64_t share[3] = {of_row[0], of_row[1], of_row[2]};
    for (std::int64_t j = 0; j <= j1 - j0; ++j) {
      met[count] = std::uint16_t(k * kSide + j);
      count += std::size_t((share[0] | share[1] | share[2]) >= 0);
      for (std::size_t i = 0; i < 3; ++i) share[i] += per_j[i];
    }
    for (std::size_t i = 0; i < 3; ++i) of_row[i] += per_k[i];
  }
  if (count == 0) return;
  const Along along = make_along(p, axis, area);
  for (std::size_t n = 0; n < count; ++n) {
    const std::int64_t j = met[n] % kSide, k = met[n] / kSide;
    std::int64_t share[3];
    for (std::size_t i = 0; i < 3; ++i) share[i] = line[i] + j * per_j[i] + k * per_k[i];
    const double at =
        along.first + (double(share[1]) * along.second + double(share[2]) * along.third);
    const Hit hit = locate(at, [&] { return locate_exactly(along.corner, share, area); });
    mark<axis>(hit, j0 + j, k0 + k, rows, crossings);
  }
}

}  // namespace

void cross_tile(const Surface& surface, const Grid& grid, std::size_t tile,
                std::span<const std::uint32_t> triangles, NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  if (tiles.first[tile] == tiles.first[tile + 1]) return;
  const std::array<int, 3> first = tiles.first_brick(tile);
  Rows rows;
  for (int i = 0; i < 64; ++i) {
    const int at[3] = {first[0] + i % 4, first[1] + i / 4 % 4, first[2] + i / 16};
    const bool in = at[0] < grid.bricks[0] && at[1] < grid.bricks[1] && at[2] < grid.bricks[2];
    rows[std::size_t(i)] = in ? band.row[grid.cell(at[0], at[1], at[2])] : -1;
  }
  thread_local const auto hits = std::make_unique<kernels::LatticeHits>();
  for (const std::uint32_t t : triangles) {
    const Vec3* v[3];
    for (std::size_t c = 0; c < 3; ++c) v[c] = &surface.vertices[surface.triangles[t][c]];
    Point p[3];
    for (std::size_t c = 0; c < 3; ++c) {
      const double at[3] = {v[c]->x, v[c]->y, v[c]->z};
      for (std::size_t k = 0; k < 3; ++k) p[c][k] = rounded(at[k]) - 8 * first[k] * kVoxel;
    }
    std::array<Lines, 3> lines;
    for (std::size_t k = 0; k < 3; ++k)
      lines[k] = {
          std::max<std::int64_t>(0, ceil_voxel(std::min({p[0][k], p[1][k], p[2][k]}))),
          std::min<std::int64_t>(kSide - 1, floor_voxel(std::max({p[0][k], p[1][k], p[2][k]})))};
    std::int32_t small[3][3], low[3], high[3];
    std::int64_t farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::int32_t(lines[k].first);
      high[k] = std::int32_t(lines[k].last);
      for (std::size_t c = 0; c < 3; ++c) {
        small[c][k] = std::int32_t(p[c][k]);
        farthest = std::max(farthest, std::abs(p[c][k]));
      }
    }
    if (farthest < kernels::kLatticeMost) {
      kernels::lattice_hits(small, low, high, *hits);
      mark_small<0>(p, *hits, low, rows, band.crossing);
      mark_small<1>(p, *hits, low, rows, band.crossing);
      mark_small<2>(p, *hits, low, rows, band.crossing);
    } else {
      draw_large<0>(p, lines, rows, band.crossing);
      draw_large<1>(p, lines, rows, band.crossing);
      draw_large<2>(p, lines, rows, band.crossing);
    }
  }
  for (const std::int32_t row : rows) {
    if (row < 0) continue;
    const std::size_t r = std::size_t(row);
    for (std::size_t z = 0; z < 8; ++z) band.free[r].z[z] &= ~band.crossing[r].on.z[z];
  }
}

}  // namespace h6::io::bake
