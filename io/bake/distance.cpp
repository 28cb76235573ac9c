// SPDX-License-Identifier: Apache-2.0
// distance.cpp - the unsigned distance of a tile's nodes to the triangles near them, and masks for
// the later steps, made while the distances are in the cache.
#include <algorithm>

#include "io/bake/grid.h"

namespace h6::io::bake {
namespace {

// The kernel works in float, so triangles that reach farther than this are first cut in double.
constexpr double kFar = 100;  // [voxel]

using Corner = std::array<double, 3>;

// The corner and the edge of the triangle that each corner and edge of a part comes from; kOwn: the
// cut made it. Edge e runs from corner e to the next.
constexpr std::int8_t kOwn = -1;
struct Part {
  std::array<std::int8_t, 3> corner, edge;
};

// A triangle that is not cut. Its corners are in such an order that the edges to be measured come
// first.
struct Whole {
  Part part;
  std::uint8_t weighed;  // number of edges to be measured
};
// For a value of Features::owned. An owned corner is the end of an edge that is measured.
constexpr Whole make_whole(unsigned owned) {
  unsigned edges = owned & 7;
  const unsigned ends = edges | edges << 1 | edges >> 2;
  edges |= owned >> 3 & ~ends & 7;
  Whole whole{};
  whole.weighed = std::uint8_t(std::popcount(edges));
  unsigned first = 0;
  while (((edges << 3 | edges) >> first & 7) != (1u << whole.weighed) - 1) ++first;
  for (unsigned i = 0; i < 3; ++i)
    whole.part.corner[i] = whole.part.edge[i] = std::int8_t((first + i) % 3);
  return whole;
}
constexpr std::array<Whole, 64> make_wholes() {
  std::array<Whole, 64> wholes{};
  for (unsigned owned = 0; owned < 64; ++owned) wholes[owned] = make_whole(owned);
  return wholes;
}
constexpr std::array<Whole, 64> kWholes = make_wholes();

struct PolygonCorner {
  Corner at;
  std::int8_t corner, edge;  // as in Part; the edge leaves this corner
};
using Polygon = std::vector<PolygonCorner>;

// Keeps the part of a convex polygon with side * (p[axis] - level) <= 0.
void cut(Polygon& polygon, std::size_t axis, double level, double side, Polygon& kept) {
  kept.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const PolygonCorner &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at = side * (p.at[axis] - level), next = side * (q.at[axis] - level);
    if (at <= 0) kept.push_back({p.at, p.corner, at == 0 && next > 0 ? kOwn : p.edge});
    if ((at < 0 && next > 0) || (at > 0 && next < 0)) {
      const double s = at / (at - next);
      Corner c;
      for (std::size_t k = 0; k < 3; ++k) c[k] = p.at[k] + s * (q.at[k] - p.at[k]);
      kept.push_back({c, kOwn, next > 0 ? kOwn : p.edge});
    }
  }
  polygon.swap(kept);
}

void add_triangle(std::vector<double>& corners, const Corner& a, const Corner& b, const Corner& c) {
  corners.insert(corners.end(), a.begin(), a.end());
  corners.insert(corners.end(), b.begin(), b.end());
  corners.insert(corners.end(), c.begin(), c.end());
}

// The part of a large triangle that can be within reach of the tile, as a fan.
void add_part_near(std::vector<double>& corners, std::vector<Part>& parts, const Corner (&t)[3],
                   double reach) {
  Polygon polygon{{t[0], 0, 0}, {t[1], 1, 1}, {t[2], 2, 2}}, scratch;
  for (std::size_t k = 0; k < 3; ++k) {
    cut(polygon, k, 8.0 * kernels::kTileBricks + reach, 1.0, scratch);
    cut(polygon, k, -1.0 - reach, -1.0, scratch);
  }
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const PolygonCorner &a = polygon[0], &b = polygon[i - 1], &c = polygon[i];
    add_triangle(corners, a.at, b.at, c.at);
    parts.push_back({{a.corner, b.corner, c.corner},
                     {i == 2 ? a.edge : kOwn, b.edge, i + 1 == polygon.size() ? c.edge : kOwn}});
  }
}

// The triangles of a tile, cut and prepared for the kernel.
struct Facets {
  std::vector<kernels::DistanceFacet> facet;
  std::vector<kernels::FacetRegion> region;  // may be longer than facet
  std::vector<std::uint64_t> near;           // bricks
  std::vector<double> corners;               // 9 each, tile-local
  std::vector<Part> part;
  std::vector<std::int32_t> owner;    // triangle
  std::vector<std::uint8_t> weighed;  // edges to be measured; parts of a cut triangle: all
  struct Place {
    std::uint32_t facet, k, source;  // edge or corner k of the facet; its index in Features
  };
  std::vector<Place> edge, end;        // owned edges and corners
  std::vector<std::size_t> large;      // entries of the tile's list that must be cut
  std::vector<std::uint32_t> in_tile;  // triangles that may meet the tile itself
  void resize(std::size_t count) {
    near.resize(count);
    corners.resize(9 * count);
    part.resize(count);
    owner.resize(count);
    weighed.resize(count);
  }
};

void set_plane(kernels::FacetRegion& region, std::size_t k, const Features::Gradient& g,
               const double* zero_at) {
  region.gx[k] = g[0];
  region.gy[k] = g[1];
  region.gz[k] = g[2];
  region.c[k] = float(-(g[0] * zero_at[0] + g[1] * zero_at[1] + g[2] * zero_at[2]));
}

// Bit k: place k of this part is an edge or corner that the triangle owns.
template <class Places>
std::uint8_t owned_places(const Places& places, unsigned owned) {
  unsigned bits = 0;
  for (unsigned k = 0; k < 3; ++k) bits |= (places[k] >= 0 ? owned >> places[k] & 1 : 0) << k;
  return std::uint8_t(bits);
}

// Prefetches a small object, which may lie on two cache lines.
template <class T>
void ask_for(const T* first, std::size_t count = 1) {
  const char* at = reinterpret_cast<const char*>(first);
  __builtin_prefetch(at);
  __builtin_prefetch(at + count * sizeof(T) - 1);
}

// The data of a tile's triangles is scattered over memory, so it is prefetched: first the triangle,
// later the vertices that it names.
void ask_for_triangle(const Surface& surface, const Features& features, std::uint32_t t) {
  ask_for(&surface.triangles[t]);
  __builtin_prefetch(&features.owned[t]);
}
void ask_for_corners(const Surface& surface, std::uint32_t t) {
  for (const std::uint32_t v : surface.triangles[t]) ask_for(&surface.vertices[v]);
}

// Sets the regions in which facets may be the nearest. Beyond an edge that the cut made, no part is
// the nearest within reach, since the whole triangle continues there. A point behind both of the
// triangle's edges at a corner is behind every edge between them, and so behind those of the part.
//
// Which edges and corners a triangle owns is unpredictable, so they are listed without branches
// first.
void set_regions(const Surface& surface, const Features& features, Facets& out) {
  const std::size_t count = out.facet.size();
  if (out.region.size() < count) out.region.resize(count);
  out.edge.resize(3 * count);
  out.end.resize(3 * count);
  std::size_t edges = 0, ends = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const std::uint32_t t = std::uint32_t(out.owner[f]);
    const unsigned owned = features.owned[t];
    const Part& part = out.part[f];
    kernels::FacetRegion& region = out.region[f];
    region.everywhere = out.facet[f].inside_from > 0;  // has no area
    region.weighed = region.everywhere ? std::uint8_t{3} : out.weighed[f];
    region.edges = region.everywhere ? std::uint8_t{0} : owned_places(part.edge, owned);
    region.corners = region.everywhere ? std::uint8_t{0} : owned_places(part.corner, owned >> 3);
    for (unsigned k = 0; k < 3; ++k) {
      out.edge[edges] = {std::uint32_t(f), k, 3 * t + std::uint32_t(part.edge[k] & 3)};
      edges += region.edges >> k & 1;
      out.end[ends] = {std::uint32_t(f), k,
                       surface.triangles[t][std::size_t(part.corner[k] & 3) % 3]};
      ends += region.corners >> k & 1;
    }
  }
  constexpr std::size_t kSoon = 12;
  const auto zero_at = [&](const Facets::Place& p) { return &out.corners[9 * p.facet + 3 * p.k]; };
  for (std::size_t i = 0; i < edges; ++i) {
    if (i + kSoon < edges) ask_for(&features.across[out.edge[i + kSoon].source]);
    const Facets::Place& p = out.edge[i];
    set_plane(out.region[p.facet], p.k, features.across[p.source], zero_at(p));
  }
  for (std::size_t i = 0; i < ends; ++i) {
    if (i + kSoon < ends) ask_for(&features.from[4 * std::size_t(out.end[i + kSoon].source)], 4);
    const Facets::Place& p = out.end[i];
    for (std::size_t n = 0; n < 4; ++n)
      set_plane(out.region[p.facet], 3 + 4 * p.k + n, features.from[4 * std::size_t(p.source) + n],
                zero_at(p));
  }
}

// Adds the triangles that may meet the tile, which ends one voxel past its last nodes.
void list_in_tile(Facets& out) {
  constexpr float kLast = 8.0f * kernels::kTileBricks, kRounding = 1e-3f;
  std::size_t count = out.in_tile.size();
  out.in_tile.resize(count + out.facet.size());
  for (std::size_t f = 0; f < out.facet.size(); ++f) {
    const kernels::DistanceFacet& facet = out.facet[f];
    bool in = count == 0 || out.in_tile[count - 1] != std::uint32_t(out.owner[f]);
    for (std::size_t k = 0; k < 3; ++k)
      in = in & (facet.low[k] <= kLast + kRounding) & (facet.high[k] >= -kRounding);
    out.in_tile[count] = std::uint32_t(out.owner[f]);
    count += in;
  }
  out.in_tile.resize(count);
}

void prepare(const Surface& surface, const Grid& grid, const Tiles& tiles, const Features& features,
             std::size_t tile, Facets& out) {
  const std::array<int, 3> brick = tiles.first_brick(tile);
  constexpr std::size_t kSoon = 6, kLater = 12;
  const std::size_t begin = tiles.first[tile], end = tiles.first[tile + 1];
  out.resize(end - begin);
  out.large.clear();
  out.in_tile.clear();
  const std::uint64_t wanted = grid.wanted == nullptr ? ~std::uint64_t{0} : (*grid.wanted)[tile];
  std::size_t count = 0;
  for (std::size_t i = begin; i < std::min(end, begin + kLater); ++i)
    ask_for_triangle(surface, features, tiles.triangle[i]);
  for (std::size_t i = begin; i < std::min(end, begin + kSoon); ++i)
    ask_for_corners(surface, tiles.triangle[i]);
  for (std::size_t i = begin; i < end; ++i) {
    if (i + kLater < end) ask_for_triangle(surface, features, tiles.triangle[i + kLater]);
    if (i + kSoon < end) ask_for_corners(surface, tiles.triangle[i + kSoon]);
    const std::uint32_t t = tiles.triangle[i];
    if ((tiles.near[i] & wanted) == 0) {
      out.in_tile.push_back(t);
      continue;
    }
    const Whole& whole = kWholes[features.owned[t]];
    double* corner = &out.corners[9 * count];
    double farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = surface.vertices[surface.triangles[t][std::size_t(whole.part.corner[k])]];
      corner[3 * k] = v.x - 8.0 * brick[0];
      corner[3 * k + 1] = v.y - 8.0 * brick[1];
      corner[3 * k + 2] = v.z - 8.0 * brick[2];
      for (std::size_t c = 0; c < 3; ++c)
        farthest = std::max(farthest, std::fabs(corner[3 * k + c]));
    }
    if (farthest >= kFar) {
      out.large.push_back(i);
      continue;
    }
    out.part[count] = whole.part;
    out.near[count] = tiles.near[i] & wanted;
    out.owner[count] = std::int32_t(t);
    out.weighed[count++] = whole.weighed;
  }
  out.resize(count);
  for (const std::size_t i : out.large) {
    const std::uint32_t t = tiles.triangle[i];
    Corner corner[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = surface.vertices[surface.triangles[t][k]];
      corner[k] = {v.x - 8.0 * brick[0], v.y - 8.0 * brick[1], v.z - 8.0 * brick[2]};
    }
    add_part_near(out.corners, out.part, corner, grid.reach());
    out.near.resize(out.part.size(), tiles.near[i] & wanted);
    out.owner.resize(out.part.size(), std::int32_t(t));
    out.weighed.resize(out.part.size(), 3);
  }
  out.facet.resize(out.part.size());
  kernels::make_distance_facets(out.corners.data(), out.facet.size(), out.facet.data());
  set_regions(surface, features, out);
  list_in_tile(out);
}

NodeMask above(const float* u, float level) {
  NodeMask mask;
  kernels::nodes_above(u, level, mask.z.data());
  return mask;
}

}  // namespace

void give_slots(const Grid& grid, NarrowBand& band) {
  band.slot.resize(band.rows());
  constexpr std::uint32_t kShared = ~std::uint32_t{0};
  std::uint32_t slots = 0;
  for (std::size_t r = 0; r < band.rows(); ++r)
    band.slot[r] = grid.wants(band.cell[r]) ? slots++ : kShared;
  std::replace(band.slot.begin(), band.slot.end(), kShared, slots);
  band.u.resize((slots + 1) * kBrickSamples);
  std::fill_n(band.u.data() + slots * kBrickSamples, kBrickSamples, float(grid.reach()));
}

std::span<const std::uint32_t> measure_tile(const Surface& surface, const Grid& grid,
                                            std::size_t tile, NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  if (tiles.first[tile] == tiles.first[tile + 1]) return {};
  thread_local Facets facets;
  thread_local const auto room = std::make_unique<kernels::TileRoom>();
  prepare(surface, grid, tiles, *band.features, tile, facets);
  kernels::tile_distance(facets.facet.data(), facets.region.data(), facets.near.data(),
                         facets.owner.data(), facets.facet.size(), float(grid.reach()), *room);
  const std::array<int, 3> brick = tiles.first_brick(tile);
  const float zero_set = float(grid.near_zero_set());
  const std::uint64_t wanted = grid.wanted == nullptr ? ~std::uint64_t{0} : (*grid.wanted)[tile];
  std::uint64_t used = 0, weighed = 0;
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) used |= tiles.near[i];
  for (std::uint64_t near : facets.near) weighed |= near;
  for (const std::int32_t owner : room->nearest)
    if (owner != kernels::kNobody) __builtin_prefetch(&surface.source[std::size_t(owner)]);
  for (; used != 0; used &= used - 1) {
    const int b = std::countr_zero(used);
    const int in[3] = {b % 4, b / 4 % 4, b / 16};
    const std::size_t r =
        std::size_t(band.row[grid.cell(brick[0] + in[0], brick[1] + in[1], brick[2] + in[2])]);
    if ((wanted >> b & 1) == 0) {
      band.first_node[r] = float(grid.reach());
      band.free[r] = kAllNodes;
      band.towards[r] = 0;
      continue;
    }
    float* u = band.nodes(r);
    if (weighed >> b & 1)
      kernels::brick_distance(*room, std::size_t(b), u);
    else  // the cut left no part of the large triangles here
      std::fill_n(u, kBrickSamples, float(grid.reach()));
    band.first_node[r] = u[0];
    band.free[r] = above(u, float(grid.offset));
    NodeMask near = above(u, std::nextafter(zero_set, 0.0f));
    for (std::uint64_t& z : near.z) z = ~z;
    band.towards[r] = neighbours_of(near);
    const std::int32_t owner = room->nearest[b];
    if (owner == kernels::kNobody) continue;
    band.triangle[r] = surface.source[std::size_t(owner)];
    if (!band.part.empty()) band.part[r] = surface.part[std::size_t(owner)];
  }
  return facets.in_tile;
}

}  // namespace h6::io::bake
