// bake_bins.cpp - which triangles come within reach of which bricks.
//
// A triangle visits the bricks of its box. Where that is many, the range is halved and each half is
// kept only if no plane of the triangle separates it (face normal and the edges' normals in the
// coordinate planes), so a long diagonal sliver costs as much as the bricks it passes.
#include <algorithm>
#include <atomic>
#include <cstdio>

#include "io/bake_grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kMaxBricks = 1'400'000;
constexpr std::size_t kMaxPairs = 600'000'000;
constexpr std::size_t kSlice = 1024;  // triangles
// Up to this size a triangle's box tells enough, and it touches at most 4 bricks along an axis as
// long as the reach is moderate.
constexpr double kSmall = 4;          // [voxel]
constexpr double kSmallReach = 10;    // [voxel]; 2 * 10 + 4 < 3 * 8 + 1

struct Range {
  int low[3], high[3];  // bricks, inclusive
  long size() const {
    return long(high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
  }
};

// Half-spaces {n.x <= level} that hold the triangle; n is unit. A box beyond one by more than reach
// has no node within reach.
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
  const auto both_sides = [&](double (&axis)[3]) {
    const double length =
        std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
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
    middle[k] = 4.0 * (r.low[k] + r.high[k]) + 3.5;
    half[k] = 4.0 * (r.high[k] - r.low[k]) + 3.5;
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
  std::uint32_t cell, triangle;
};

void bin_triangle(const Surface& surface, const Grid& grid, std::size_t t, std::vector<Pair>& out) {
  double p[3][3];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& v = surface.vertices[surface.triangles[t][i]];
    p[i][0] = v.x;
    p[i][1] = v.y;
    p[i][2] = v.z;
  }
  const double reach = grid.reach();
  Range r;
  double low[3], high[3], longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min({p[0][k], p[1][k], p[2][k]});
    high[k] = std::max({p[0][k], p[1][k], p[2][k]});
    longest = std::max(longest, high[k] - low[k]);
    r.low[k] = std::max(0, int(std::ceil((low[k] - reach - 7) / 8)));
    r.high[k] = std::min(grid.bricks[k] - 1, int(std::floor((high[k] + reach) / 8)));
  }
  if (r.size() <= 0) return;
  const auto add = [&](int a, int b, int c) {
    out.push_back({std::uint32_t(grid.cell(a, b, c)), std::uint32_t(t)});
  };
  if (longest > kSmall || reach > kSmallReach) return visit(make_separators(p), r, reach, add);
  double gap2[3][4];  // of the triangle's box to each layer of bricks, squared
  for (int k = 0; k < 3; ++k)
    for (int b = r.low[k]; b <= r.high[k]; ++b) {
      const double gap = std::max({0.0, low[k] - (8.0 * b + 7), 8.0 * b - high[k]});
      gap2[k][b - r.low[k]] = gap * gap;
    }
  for (int c = r.low[2]; c <= r.high[2]; ++c)
    for (int b = r.low[1]; b <= r.high[1]; ++b) {
      const double left = reach * reach - gap2[2][c - r.low[2]] - gap2[1][b - r.low[1]];
      if (left < 0) continue;
      for (int a = r.low[0]; a <= r.high[0]; ++a)
        if (gap2[0][a - r.low[0]] <= left) add(a, b, c);
    }
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

Outcome find_candidates(const Surface& surface, const Grid& grid, unsigned threads,
                        NarrowBand& band) {
  const std::size_t slices = (surface.triangles.size() + kSlice - 1) / kSlice;
  std::vector<std::vector<Pair>> pairs(slices);
  std::vector<std::atomic<std::uint32_t>> count(grid.cells());
  std::atomic<std::size_t> total{0};
  sched::parallel_for(slices, threads, [&](std::size_t s) {
    const std::size_t end = std::min(surface.triangles.size(), (s + 1) * kSlice);
    for (std::size_t t = s * kSlice; t < end; ++t) {
      if (total.load(std::memory_order_relaxed) > kMaxPairs) return;
      const std::size_t before = pairs[s].size();
      bin_triangle(surface, grid, t, pairs[s]);
      for (std::size_t i = before; i < pairs[s].size(); ++i)
        count[pairs[s][i].cell].fetch_add(1, std::memory_order_relaxed);
      total.fetch_add(pairs[s].size() - before, std::memory_order_relaxed);
    }
  });
  if (total > kMaxPairs) return too_many(grid, 4.0);

  band.row.assign(grid.cells(), -1);
  band.first.assign(1, 0);
  for (std::size_t c = 0; c < grid.cells(); ++c) {
    if (count[c] == 0) continue;
    band.row[c] = std::int32_t(band.cell.size());
    band.cell.push_back(std::uint32_t(c));
    band.first.push_back(band.first.back() + count[c]);
    count[c] = 0;  // from here on: how many are in place
  }
  if (band.rows() > kMaxBricks) return too_many(grid, double(band.rows()) / kMaxBricks);
  band.triangle.resize(band.first.back());
  sched::parallel_for(slices, threads, [&](std::size_t s) {
    for (const Pair& p : pairs[s]) {
      const std::uint32_t at = count[p.cell].fetch_add(1, std::memory_order_relaxed);
      band.triangle[band.first[std::size_t(band.row[p.cell])] + at] = p.triangle;
    }
    std::vector<Pair>().swap(pairs[s]);
  });
  return Done{};  // threads filled the lists in any order: measure_row sorts them, row by row
}

}  // namespace h6::io::bake
