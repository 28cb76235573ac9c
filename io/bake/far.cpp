// SPDX-License-Identifier: Apache-2.0
// far.cpp - lower bounds of the distance at every eighth node.
//
// The narrow band knows the nodes near the surface. Among the other nodes, those that are even
// along all axes are searched. A search starts at the leaves that held the nearest triangles of the
// nodes before; they nearly always hold the nearest one again, and the search only has to prove it.
//
// Most other nodes need no search. With q over the surface
//   d(p)^2 - |p|^2 = min over q of (|q|^2 - 2 p.q)
// is a minimum of linear functions of p and therefore concave. Half way between two nodes c it is
// at least their mean: d(p)^2 >= mean of (d(c)^2 - |c - p|^2), also with lower bounds of d(c). The
// pair c along the way to the surface gives the best bound. The bound is taken if a triangle near
// one of the c shows that it is close enough; else the node is searched.
//
// Embree's point query is slower here: on the engine bay (505,276 triangles, 1024 voxels) a search
// takes 2.5 us by RayScene, 1.7 us in plain single precision and 0.76 us by the tree; on a torus of
// 100,000 triangles it takes 11, 6 and 0.81 us (bench/far_search_bench.cpp).
#include <algorithm>
#include <bit>
#include <cmath>

#include "io/bake/grid.h"
#include "io/bake/tree.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr double kFloatError = 1e-4;  // [voxel] error of float distances near the surface

// The part of node (8a, 8b, 8c) that is known without a search. Nodes past the last brick are
// outside.
struct Known {
  bool inside;
  double u;  // negative: not known
};
Known look_up(const Grid& grid, const NarrowBand& band, const Reached& reached, int a, int b,
              int c) {
  if (a >= grid.bricks[0] || b >= grid.bricks[1] || c >= grid.bricks[2]) return {false, -1};
  const std::size_t cell = grid.cell(a, b, c);
  const std::int32_t r = band.row[cell];
  if (r < 0) return {reached.cell[cell] == 0, -1};
  const float u = band.first_node[std::size_t(r)];
  return {!reached.node[std::size_t(r)].get(0), u < float(grid.reach()) ? double(u) : -1};
}

// A lower bound of the distance to the zero set, from u. Outside it is u - offset. Inside, R is at
// least sqrt(u^2 - offset^2) away: it can be nearer than u only through a crack narrower than
// 2 offset, and the crack is that far away.
double bound(double u, double offset, bool inside) {
  const double certain = u - kFloatError - 1e-6 * u;
  if (!inside) return std::max(0.0, certain - offset);
  if (u <= offset) return std::max(0.0, offset - u - kFloatError);
  return std::sqrt(std::max(0.0, certain * certain - offset * offset));
}

// A bound may be lower than the distance by at most this [voxel] and at most an eighth of itself.
// Over the nodes of a soup the loss averages a twelfth of a voxel. The engine's bound between nodes
// then stays within a voxel of the truth on average wherever it would with exact nodes.
constexpr double kLoose = 0.67;

constexpr double kSpacing = 8;  // of nodes [voxel]

// Lower bounds of the distances [voxel] of the nodes (8a, 8b, 8c). The order: nodes of even a, b
// and c; then the others layer by layer, layers of odd c before those of even c, and within a layer
// nodes with more odd coordinates first.
class Nodes {
 public:
  Nodes(const Grid& grid, const TriangleTree& tree) : tree_(tree) {
    for (std::size_t k = 0; k < 3; ++k) count_[k] = grid.bricks[k] + 1;
    stride_[1] = count_[0];
    stride_[2] = stride_[1] * count_[1];
    node_.resize(std::size_t(stride_[2] * count_[2]));
    for (int odd = 1; odd < 8; ++odd) find_pairs(odd);
  }
  int count(std::size_t k) const { return count_[k]; }
  std::size_t at(int a, int b, int c) const {
    return std::size_t(c * stride_[2] + b * stride_[1] + a);
  }

  // `known`: the distance if it is known, else negative. Even nodes of a layer must come in the
  // order of a, then b: each starts from those before it. Other nodes must come in the order above.
  double away(int a, int b, int c, double known) {
    const std::size_t i = at(a, b, c);
    const int odd = (a & 1) | (b & 1) << 1 | (c & 1) << 2;
    node_[i].nearest = TriangleTree::kNone;
    const double away = known >= 0 ? std::max(0.0, known - kFloatError - 1e-6 * known)
                        : odd == 0 ? even(a, b, c)
                                   : between(a, b, c, odd);
    node_[i].away = std::nextafter(float(away), 0.0f);
    return double(node_[i].away);
  }

 private:
  struct Node {
    float away;
    std::uint32_t nearest;  // place in the tree, or kNone
  };
  // Two nodes on opposite sides of a node, at `step` and `-step`.
  struct Pair {
    std::ptrdiff_t step;
    double way, way2;
    int along;  // bit k: the step is not 0 along axis k
  };
  // The start of a search, from the nodes near by.
  struct Start {
    double most = 1e5;  // [voxel] upper bound of the distance
    std::size_t count = 0;
    std::uint32_t place[TriangleTree::kStarts];
    void add(std::uint32_t nearest) {
      if (nearest == TriangleTree::kNone || count == TriangleTree::kStarts) return;
      for (std::size_t i = 0; i < count; ++i)
        if (TriangleTree::together(place[i], nearest)) return;
      place[count++] = nearest;
    }
  };

  // Finds the pairs around a node whose coordinates are odd along the axes of the bits in `odd`.
  // Both nodes of a pair must be known before the node.
  void find_pairs(int odd) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const std::ptrdiff_t step = z * stride_[2] + y * stride_[1] + x;
          const int along = (x & 1) | (y & 1) << 1 | (z & 1) << 2, there = odd ^ along;
          const bool before =
              there == 0 || std::popcount(unsigned(there)) > std::popcount(unsigned(odd));
          if (!before || z * 9 + y * 3 + x <= 0) continue;
          // In an even layer, nodes that are not themselves even come later.
          if ((odd & along & 4) != 0 && there != 0) continue;
          const double way2 = (x * x + y * y + z * z) * kSpacing * kSpacing;
          pairs_[odd].push_back({step, std::sqrt(way2), way2, along});
        }
  }

  double even(int a, int b, int c) {
    const std::size_t i = at(a, b, c), row = std::size_t(2 * stride_[1]);
    std::size_t near[3], count = 0, first = 0;
    if (a > 0) near[count++] = i - 2;
    if (b > 0) near[count++] = i - row;
    if (b > 0 && a + 2 < count_[0]) near[count++] = i - row + 2;
    Start start;
    for (std::size_t k = 0; k < count; ++k) {
      if (node_[near[k]].away < node_[near[first]].away) first = k;
      start.most =
          std::min(start.most, double(node_[near[k]].away) + std::sqrt(8.0) * kSpacing + 0.1);
    }
    for (std::size_t k = 0; k < count; ++k) start.add(node_[near[(first + k) % count]].nearest);
    return search(a, b, c, start, -1);
  }

  double between(int a, int b, int c, int odd) {
    const std::size_t i = at(a, b, c);
    const auto at_end = [](int n, int count) { return n == 0 || n + 1 == count; };
    const int end =
        int(at_end(a, count_[0])) | int(at_end(b, count_[1])) << 1 | int(at_end(c, count_[2])) << 2;
    Start start;
    double low2 = -1;
    const Pair* best = nullptr;
    for (const Pair& pair : pairs_[odd]) {
      if ((pair.along & end) != 0) continue;
      const double u = double(node_[i - std::size_t(pair.step)].away);
      const double v = double(node_[i + std::size_t(pair.step)].away);
      const double bound2 = (u * u + v * v) / 2 - pair.way2;
      start.most = std::min(start.most, std::min(u, v) + pair.way + kLoose + 0.1);
      if (best != nullptr && bound2 <= low2) continue;
      low2 = bound2;
      best = &pair;
    }
    if (best != nullptr) {
      start.add(node_[i - std::size_t(best->step)].nearest);
      start.add(node_[i + std::size_t(best->step)].nearest);
    }
    if (start.count == 0) {
      const Node& even = node_[at(a & ~1, b & ~1, c & ~1)];
      start.most = std::min(start.most, double(even.away) + std::sqrt(3.0) * kSpacing + 0.1);
      start.add(even.nearest);
    }
    const double low = std::sqrt(std::max(0.0, low2));
    const double enough = low2 > 0 ? low + std::min(kLoose, low / 8) : -1;
    return std::max(low, search(a, b, c, start, enough));
  }

  // Returns 0 where a triangle is within `enough`.
  double search(int a, int b, int c, const Start& start, double enough) {
    const double p[3] = {kSpacing * a, kSpacing * b, kSpacing * c};
    TriangleTree::Found found{float(start.most * start.most), TriangleTree::kNone, 0};
    const double away = tree_.search(p, {start.place, start.count}, enough, found);
    node_[at(a, b, c)].nearest = found.place;
    return away;
  }

  const TriangleTree& tree_;
  int count_[3];
  std::ptrdiff_t stride_[3] = {1, 0, 0};
  std::vector<Pair> pairs_[8];  // of nodes with these odd places
  std::vector<Node> node_;
};

}  // namespace

Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps, Samples& far) {
  const TriangleTree tree(surface, grid, threads);
  if (!steps.tell("far field", 0.88)) return Failure{"cancelled"};
  Nodes nodes(grid, tree);
  const int nx = nodes.count(0), ny = nodes.count(1), nz = nodes.count(2);
  far.resize(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  // Every second node of a row. The band is looked up for the whole row first, so that no search
  // waits for memory.
  const auto row = [&](int first, int b, int c, std::vector<Known>& known) {
    for (int a = first; a < nx; a += 2)
      known[std::size_t(a / 2)] = look_up(grid, band, reached, a, b, c);
    for (int a = first; a < nx; a += 2) {
      const auto [inside, near] = known[std::size_t(a / 2)];
      const double u = bound(nodes.away(a, b, c, near), grid.offset, inside);
      far[nodes.at(a, b, c)] = float((inside ? -u : u) * grid.voxel * (1 - 1e-6));
    }
  };
  const auto even_nodes = [&](std::size_t layer) {
    std::vector<Known> known(std::size_t(nx) / 2 + 1);
    for (int b = 0; b < ny; b += 2) row(0, b, int(2 * layer), known);
  };
  // Row by row, so that searches find their neighbours' leaves in the caches.
  const auto others = [&](int c) {
    std::vector<Known> known(std::size_t(nx) / 2 + 1);
    for (int b = 0; b < ny; b += 2) {
      if (b + 1 < ny)
        for (const int first : {1, 0}) row(first, b + 1, c, known);
      row(1, b, c, known);
      if ((c & 1) != 0) row(0, b, c, known);
    }
  };
  const std::size_t odd_layers = std::size_t(nz / 2), even_layers = std::size_t(nz) - odd_layers;
  if (!steps.run("far field", 0.88, 0.92, even_layers, threads, even_nodes) ||
      !steps.run("far field", 0.92, 0.96, odd_layers, threads,
                 [&](std::size_t layer) { others(int(2 * layer + 1)); }) ||
      !steps.run("far field", 0.96, 1.0, even_layers, threads,
                 [&](std::size_t layer) { others(int(2 * layer)); }))
    return Failure{"cancelled"};
  return Done{};
}

}  // namespace h6::io::bake
