// SPDX-License-Identifier: Apache-2.0
// bins.cpp - finds the triangles within reach of each brick.
//
// A triangle visits the tiles of its box and tests the 64 bricks of a tile at once. If the tiles
// are many, their range is halved, and a half is dropped if a plane of the triangle separates it
// (the face, or an edge's normal in a coordinate plane). So a long diagonal sliver costs only the
// tiles that it passes.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>

#include "io/bake/grid.h"
#include "io/bake/plan.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kMaxBricks = 1'400'000;
constexpr std::size_t kMaxPairs = 200'000'000;
constexpr std::size_t kSlice = 1024;             // triangles
constexpr int kTile = 8 * kernels::kTileBricks;  // nodes along a side
constexpr long kFew = 12;                        // tiles
constexpr double kRounding = 4e-3;               // several roundings of a float at 2048 voxels

struct Range {
  int low[3], high[3];  // tiles, inclusive
  long size() const {
    return long(high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
  }
};

// Half-spaces {n.x <= level} that contain the triangle; n is a unit vector. A box that lies beyond
// one of them by more than the reach has no node within reach.
struct Separators {
  double n[20][3], level[20];
  int count = 0;
  void add(const double* axis, double bound) {
    for (int k = 0; k < 3; ++k) n[count][k] = axis[k];
    level[count++] = bound;
  }
};

Separators make_separators(const double (&p)[3][3]) {
  Separators s;
  const auto both_sides = [&](double(&axis)[3]) {
    const double length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    if (length < 1e-9) return;
    for (double& c : axis) c /= length;
    double low = std::numeric_limits<double>::max(), high = -low;
    for (const auto& q : p) {
      const double at = axis[0] * q[0] + axis[1] * q[1] + axis[2] * q[2];
      low = std::min(low, at);
      high = std::max(high, at);
    }
    s.add(axis, high);
    for (double& c : axis) c = -c;
    s.add(axis, -low);
  };
  double e[3][3];
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) e[i][k] = p[(i + 1) % 3][k] - p[i][k];
  double face[3];
  for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    face[k] = e[0][k1] * e[1][k2] - e[0][k2] * e[1][k1];
  }
  both_sides(face);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      double axis[3] = {0, 0, 0};
      axis[(k + 1) % 3] = e[i][(k + 2) % 3];
      axis[(k + 2) % 3] = -e[i][(k + 1) % 3];
      both_sides(axis);
    }
  return s;
}

bool within_reach(const Separators& s, const Range& r, double reach) {
  double middle[3], half[3];
  for (int k = 0; k < 3; ++k) {
    middle[k] = 0.5 * (kTile * (r.low[k] + r.high[k]) + kTile - 1);
    half[k] = 0.5 * (kTile * (r.high[k] - r.low[k]) + kTile - 1);
  }
  for (int i = 0; i < s.count; ++i) {
    const double* n = s.n[i];
    const double at = n[0] * middle[0] + n[1] * middle[1] + n[2] * middle[2];
    const double extent =
        std::fabs(n[0]) * half[0] + std::fabs(n[1]) * half[1] + std::fabs(n[2]) * half[2];
    if (at - extent > s.level[i] + reach) return false;
  }
  return true;
}

template <class F>
void visit(const Separators& s, const Range& r, double reach, F&& found) {
  if (!within_reach(s, r, reach)) return;
  if (r.size() == 1) return found(r.low[0], r.low[1], r.low[2]);
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (r.high[k] - r.low[k] > r.high[axis] - r.low[axis]) axis = k;
  Range half = r;
  const int middle = (r.low[axis] + r.high[axis]) / 2;
  half.high[axis] = middle;
  visit(s, half, reach, found);
  half = r;
  half.low[axis] = middle + 1;
  visit(s, half, reach, found);
}

struct Pair {
  std::uint64_t near;
  std::uint32_t tile, triangle;
};

// The bricks of a tile that lie in the grid.
std::uint64_t bricks_there(const Grid& grid, const int (&tile)[3]) {
  std::uint64_t there = 0;
  for (int b = 0; b < 64; ++b)
    if (4 * tile[0] + b % 4 < grid.bricks[0] && 4 * tile[1] + b / 4 % 4 < grid.bricks[1] &&
        4 * tile[2] + b / 16 < grid.bricks[2])
      there |= std::uint64_t{1} << b;
  return there;
}

// A triangle and the tiles that meet its box, enlarged by the reach.
struct Boxed {
  std::uint32_t triangle;
  Range tiles;
};

// A batch of triangles that are prepared together. Corners are relative to the first node of the
// first tile.
struct Batch {
  static constexpr std::size_t kMost = 64;
  std::vector<Boxed> boxed;
  std::vector<double> corners;  // 9 each
  std::vector<kernels::DistanceFacet> facets;
};

void box_triangle(const Surface& surface, const Grid& grid, const Tiles& tiles, std::size_t t,
                  Batch& batch) {
  const Vec3* v[3];
  for (std::size_t i = 0; i < 3; ++i) v[i] = &surface.vertices[surface.triangles[t][i]];
  const double p[3][3] = {
      {v[0]->x, v[0]->y, v[0]->z}, {v[1]->x, v[1]->y, v[1]->z}, {v[2]->x, v[2]->y, v[2]->z}};
  const double reach = grid.reach();
  Range r;
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = std::min({p[0][k], p[1][k], p[2][k]});
    const double high = std::max({p[0][k], p[1][k], p[2][k]});
    r.low[k] = std::max(0, int(std::ceil((low - reach - (kTile - 1)) / kTile)));
    r.high[k] = std::min(tiles.size[k] - 1, int(std::floor((high + reach) / kTile)));
    if (r.low[k] > r.high[k]) return;
  }
  for (const auto& corner : p)
    for (int k = 0; k < 3; ++k) batch.corners.push_back(corner[k] - kTile * r.low[k]);
  batch.boxed.push_back({std::uint32_t(t), r});
}

void bin_triangle(const Grid& grid, const Tiles& tiles, const Boxed& boxed, const double* corners,
                  const kernels::DistanceFacet& facet, std::vector<Pair>& out) {
  const Range& r = boxed.tiles;
  const double reach = grid.reach();
  const auto add = [&](int a, int b, int c) {
    const int tile[3] = {a, b, c};
    const float first[3] = {float(kTile * (a - r.low[0])), float(kTile * (b - r.low[1])),
                            float(kTile * (c - r.low[2]))};
    std::uint64_t near = kernels::bricks_within_reach(facet, first, float(reach + kRounding));
    if (near == 0) return;
    if (grid.wanted != nullptr) {
      const std::uint64_t wanted = (*grid.wanted)[tiles.of({4 * a, 4 * b, 4 * c})];
      if ((near & ~wanted) != 0)
        near &= wanted | kernels::bricks_within_reach(facet, first, float(1 + kRounding));
      if (near == 0) return;
    }
    if (4 * a + 4 > grid.bricks[0] || 4 * b + 4 > grid.bricks[1] || 4 * c + 4 > grid.bricks[2])
      near &= bricks_there(grid, tile);
    if (near != 0)
      out.push_back({near, std::uint32_t(tiles.of({4 * a, 4 * b, 4 * c})), boxed.triangle});
  };
  if (r.size() > kFew) {
    double p[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) p[i][k] = corners[3 * i + k] + kTile * r.low[k];
    return visit(make_separators(p), r, reach, add);
  }
  for (int c = r.low[2]; c <= r.high[2]; ++c)
    for (int b = r.low[1]; b <= r.high[1]; ++b)
      for (int a = r.low[0]; a <= r.high[0]; ++a) add(a, b, c);
}

// Triangles begin ... end.
void bin_triangles(const Surface& surface, const Grid& grid, const Tiles& tiles, std::size_t begin,
                   std::size_t end, std::vector<Pair>& out) {
  thread_local Batch batch;
  batch.boxed.clear();
  batch.corners.clear();
  for (std::size_t t = begin; t < end; ++t) box_triangle(surface, grid, tiles, t, batch);
  batch.facets.resize(batch.boxed.size());
  kernels::make_distance_facets(batch.corners.data(), batch.facets.size(), batch.facets.data());
  for (std::size_t i = 0; i < batch.boxed.size(); ++i)
    bin_triangle(grid, tiles, batch.boxed[i], batch.corners.data() + 9 * i, batch.facets[i], out);
}

// Numbers the rows in the order of cells and returns how many there are; makes none if there are
// too many.
std::size_t number_rows(const Grid& grid, const std::vector<std::uint64_t>& used, unsigned threads,
                        NarrowBand& band) {
  const Tiles& tiles = band.tiles;
  // Calls f(cell) for the cells of a layer that have a row, in order.
  const auto each_cell = [&](int c, auto&& f) {
    for (int b = 0; b < grid.bricks[1]; ++b)
      for (int a = 0; a < grid.bricks[0]; a += 4) {
        const std::uint64_t line = used[tiles.of({a, b, c})] >> Tiles::bit({a, b, c}) & 0xf;
        for (int i = 0; i < 4; ++i)
          if (line >> i & 1) f(grid.cell(a + i, b, c));
      }
  };
  const std::size_t layers = std::size_t(grid.bricks[2]);
  std::vector<std::size_t> first(layers + 1, 0);
  sched::parallel_for(layers, threads, [&](std::size_t c) {
    std::size_t count = 0;
    each_cell(int(c), [&](std::size_t) { ++count; });
    first[c + 1] = count;
  });
  for (std::size_t c = 0; c < layers; ++c) first[c + 1] += first[c];
  const std::size_t rows = first[layers];
  if (rows > kMaxBricks) return rows;
  band.row.assign(grid.cells(), -1);
  band.cell.resize(rows);
  sched::parallel_for(layers, threads, [&](std::size_t c) {
    std::size_t r = first[c];
    each_cell(int(c), [&](std::size_t cell) {
      band.row[cell] = std::int32_t(r);
      band.cell[r++] = std::uint32_t(cell);
    });
  });
  return rows;
}

Failure too_many(const Grid& grid, double excess) {
  char text[200];
  std::snprintf(
      text, sizeof text,
      "the surface fills too many bricks of 8x8x8 nodes: choose voxels of at least %.4g m",
      grid.voxel * 1.03 * std::sqrt(excess));
  return Failure{text};
}

}  // namespace

Outcome find_candidates(const Surface& surface, const Grid& grid, const FieldBake& options,
                        NarrowBand& band) {
  const unsigned threads = options.threads;
  // Pairs are here twice while they are sorted, and some room is lost while they are found.
  const std::optional<std::uint64_t> free = options.free_memory();
  const std::size_t most =
      std::min<std::uint64_t>(kMaxPairs, free.value_or(UINT64_MAX) / (3 * sizeof(Pair)));
  Tiles& tiles = band.tiles;
  for (std::size_t k = 0; k < 3; ++k) tiles.size[k] = (grid.bricks[k] + 3) / 4;
  const std::size_t tile_count =
      std::size_t(tiles.size[0]) * std::size_t(tiles.size[1]) * std::size_t(tiles.size[2]);
  const std::size_t slices = (surface.triangles.size() + kSlice - 1) / kSlice;
  // Each worker takes slices until none is left and keeps its own counts: successive triangles
  // mostly fall into the same tiles, so shared counts would make the threads wait for each other.
  struct Worker {
    std::vector<std::vector<Pair>> slices;
    std::vector<std::uint64_t> used;  // (tiles) bricks with a triangle
    std::vector<std::size_t> place;   // (tiles) number of pairs, later where the next one goes
  };
  std::vector<Worker> workers(std::min<std::size_t>(sched::usable_threads(threads), slices));
  std::atomic<std::size_t> next{0}, total{0};
  sched::parallel_for(workers.size(), threads, [&](std::size_t w) {
    Worker& mine = workers[w];
    mine.used.assign(tile_count, 0);
    mine.place.assign(tile_count, 0);
    for (std::size_t s; (s = next.fetch_add(1, std::memory_order_relaxed)) < slices;) {
      std::vector<Pair>& pairs = mine.slices.emplace_back();
      const std::size_t end = std::min(surface.triangles.size(), (s + 1) * kSlice);
      for (std::size_t t = s * kSlice; t < end; t += Batch::kMost) {
        if (total.load(std::memory_order_relaxed) > most) return;
        const std::size_t before = pairs.size();
        bin_triangles(surface, grid, tiles, t, std::min(end, t + Batch::kMost), pairs);
        for (std::size_t i = before; i < pairs.size(); ++i) {
          ++mine.place[pairs[i].tile];
          mine.used[pairs[i].tile] |= pairs[i].near;
        }
        total.fetch_add(pairs.size() - before, std::memory_order_relaxed);
      }
    }
  });
  if (total > most) return most < kMaxPairs ? takes_more_than(double(*free)) : too_many(grid, 4.0);

  tiles.first.assign(tile_count + 1, 0);
  std::vector<std::uint64_t> used(tile_count, 0);
  std::size_t at = 0;
  for (std::size_t t = 0; t < tile_count; ++t) {
    for (Worker& worker : workers) {
      used[t] |= worker.used[t];
      at += std::exchange(worker.place[t], at);
    }
    tiles.first[t + 1] = at;
  }
  const std::size_t rows = number_rows(grid, used, threads, band);
  if (rows > kMaxBricks) return too_many(grid, double(rows) / kMaxBricks);

  tiles.triangle.resize(total);
  tiles.near.resize(total);
  sched::parallel_for(workers.size(), threads, [&](std::size_t w) {
    for (std::vector<Pair>& pairs : workers[w].slices) {
      for (const Pair& p : pairs) {
        const std::size_t to = workers[w].place[p.tile]++;
        tiles.triangle[to] = p.triangle;
        tiles.near[to] = p.near;
      }
      std::vector<Pair>().swap(pairs);
    }
  });
  return Done{};
}

}  // namespace h6::io::bake
