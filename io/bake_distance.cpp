// bake_distance.cpp - the unsigned distance of a tile's nodes to the triangles near them, and what
// the later steps ask about it, while it is in the cache.
#include <algorithm>
#include <span>

#include "io/bake_grid.h"

namespace h6::io::bake {
namespace {

// The kernel works in float: corners farther away than this are cut off first, in double.
constexpr double kFar = 100;  // [voxel]

using Corner = std::array<double, 3>;
using Polygon = std::vector<Corner>;

// Keeps the part of a convex polygon with side * (p[axis] - level) <= 0.
void cut(Polygon& polygon, std::size_t axis, double level, double side, Polygon& kept) {
  kept.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at = side * (p[axis] - level), next = side * (q[axis] - level);
    if (at <= 0) kept.push_back(p);
    if ((at < 0 && next > 0) || (at > 0 && next < 0)) {
      const double s = at / (at - next);
      Corner c;
      for (std::size_t k = 0; k < 3; ++k) c[k] = p[k] + s * (q[k] - p[k]);
      kept.push_back(c);
    }
  }
  polygon.swap(kept);
}

void add_triangle(std::vector<double>& corners, const Corner& a, const Corner& b, const Corner& c) {
  corners.insert(corners.end(), a.begin(), a.end());
  corners.insert(corners.end(), b.begin(), b.end());
  corners.insert(corners.end(), c.begin(), c.end());
}

// What of a large triangle can be within reach of the tile, as a fan.
void add_part_near(std::vector<double>& corners, const Corner (&t)[3], double reach) {
  Polygon polygon(t, t + 3), scratch;
  for (std::size_t k = 0; k < 3; ++k) {
    cut(polygon, k, 8.0 * kernels::kTileBricks + reach, 1.0, scratch);
    cut(polygon, k, -1.0 - reach, -1.0, scratch);
  }
  for (std::size_t i = 2; i < polygon.size(); ++i)
    add_triangle(corners, polygon[0], polygon[i - 1], polygon[i]);
}

// The triangles of a tile, cut and ready.
struct Facets {
  std::vector<kernels::DistanceFacet> facet;
  std::vector<std::uint64_t> near;  // bricks
  std::vector<double> corners;      // 9 each, tile-local
  std::vector<std::uint32_t> owner; // triangle
};

void prepare(const Surface& surface, const Grid& grid, const Tiles& tiles, std::size_t tile,
             Facets& out) {
  out.facet.clear();
  out.near.clear();
  out.corners.clear();
  out.owner.clear();
  const std::array<int, 3> brick = tiles.first_brick(tile);
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) {
    const std::uint32_t t = tiles.triangle[i];
    Corner corner[3];
    double farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = surface.vertices[surface.triangles[t][k]];
      corner[k] = {v.x - 8.0 * brick[0], v.y - 8.0 * brick[1], v.z - 8.0 * brick[2]};
      for (double c : corner[k]) farthest = std::max(farthest, std::fabs(c));
    }
    if (farthest < kFar)
      add_triangle(out.corners, corner[0], corner[1], corner[2]);
    else
      add_part_near(out.corners, corner, grid.reach());
    for (std::size_t f = out.facet.size(); f < out.corners.size() / 9; ++f) {
      out.facet.push_back(kernels::make_distance_facet(out.corners.data() + 9 * f));
      out.near.push_back(tiles.near[i]);
      out.owner.push_back(t);
    }
  }
}

// The triangle of the surface nearest to the middle of the brick; of equals the first.
std::uint32_t nearest_owner(const Facets& facets, std::span<const std::uint32_t> list,
                            const float (&origin)[3]) {
  const double middle[3] = {origin[0] + 3.5, origin[1] + 3.5, origin[2] + 3.5};
  double nearest = std::numeric_limits<double>::max();
  std::uint32_t owner = 0;
  for (const std::uint32_t i : list) {
    const kernels::DistanceFacet& f = facets.facet[i];
    const double off = f.gx[6] * middle[0] + f.gy[6] * middle[1] + f.gz[6] * middle[2] + f.c[6];
    if ((std::fabs(off) - 1e-3) * std::fabs(off) > nearest) continue;  // off its plane already
    const double* t = facets.corners.data() + 9 * i;
    const double d2 = kernels::point_triangle_squared(middle, t, t + 3, t + 6);
    if (d2 > nearest || (d2 == nearest && facets.owner[i] >= owner)) continue;
    nearest = d2;
    owner = facets.owner[i];
  }
  return owner;
}

NodeMask above(const float* u, float level) {
  NodeMask mask;
  kernels::nodes_above(u, level, mask.z.data());
  return mask;
}

// Neighbours (entry 13 + dx + 3*dy + 9*dz) whose side of the brick has one of these nodes.
std::uint32_t looked_at_by(const NodeMask& nodes) {
  std::uint64_t layer[3] = {nodes.z[0], 0, nodes.z[7]};  // dz = -1, 0, 1
  for (std::uint64_t z : nodes.z) layer[1] |= z;
  constexpr std::uint64_t kY[3] = {0xff, ~std::uint64_t{0}, std::uint64_t{0xff} << 56};
  constexpr std::uint64_t kX[3] = {0x0101010101010101, ~std::uint64_t{0}, 0x8080808080808080};
  std::uint32_t bits = 0;
  for (int i = 0; i < 27; ++i)
    bits |= std::uint32_t((layer[i / 9] & kY[i / 3 % 3] & kX[i % 3]) != 0) << i;
  return bits;
}

}  // namespace

void measure_tile(const Surface& surface, const Grid& grid, std::size_t tile, NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  if (tiles.first[tile] == tiles.first[tile + 1]) return;
  thread_local Facets facets;
  thread_local std::vector<std::uint32_t> list;
  prepare(surface, grid, tiles, tile, facets);
  const std::array<int, 3> brick = tiles.first_brick(tile);
  const float zero_set = float(grid.near_zero_set());
  std::uint64_t used = 0;
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) used |= tiles.near[i];
  for (; used != 0; used &= used - 1) {
    const int b = std::countr_zero(used);
    const int in[3] = {b % 4, b / 4 % 4, b / 16};
    list.resize(facets.near.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < facets.near.size(); ++i) {
      list[count] = std::uint32_t(i);
      count += facets.near[i] >> b & 1;
    }
    const std::size_t r = std::size_t(
        band.row[grid.cell(brick[0] + in[0], brick[1] + in[1], brick[2] + in[2])]);
    const float origin[3] = {float(8 * in[0]), float(8 * in[1]), float(8 * in[2])};
    float* u = band.nodes(r);
    kernels::facet_distance(facets.facet.data(), list.data(), count, origin, float(grid.reach()),
                            u);
    band.first_node[r] = u[0];
    band.free[r] = above(u, float(grid.offset));
    NodeMask near = above(u, std::nextafter(zero_set, 0.0f));
    for (std::uint64_t& z : near.z) z = ~z;
    band.towards[r] = looked_at_by(near);
    if (count == 0) continue;
    const std::uint32_t owner = nearest_owner(facets, {list.data(), count}, origin);
    band.triangle[r] = surface.source[owner];
    if (!band.part.empty()) band.part[r] = surface.part[owner];
  }
}

}  // namespace h6::io::bake
