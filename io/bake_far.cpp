// bake_far.cpp - how far every eighth node is from the surface at least.
//
// Nodes near the surface are known already. Of the others every second one each way is searched,
// with the triangles around those that were nearest to the nodes before as a start, which nearly
// always have the nearest again or one close to it: what is left is to see that no other is nearer.
//
// Between them most searches are spared. With q over the surface
//   d(p)^2 - |p|^2 = min over q of (|q|^2 - 2 p.q)
// is a least of linear functions of p, so it is concave: half way between two nodes c it is not
// less than their mean, which says d(p)^2 >= mean of (d(c)^2 - |c - p|^2). Lower bounds of d(c)
// will do. Of the pairs of nodes around p the one that lies most along the way to the surface says
// most. Where a triangle near one of the c shows that this is not far off, it is taken.
#include <algorithm>
#include <cmath>

#include "io/bake_grid.h"
#include "io/bake_tree.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr double kSlack = 1e-4;  // [voxel]; what float says near the surface

// What is known of node (8a, 8b, 8c) without a query; nodes past the last brick are outside.
struct Known {
  bool inside;
  double u;  // or negative
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

// A lower bound of the distance to the zero set, from u. Outside: u - offset. Inside the border of
// the reached region is at least sqrt(u^2 - offset^2) away: nearer only through a crack narrower
// than 2 offset, and that is how far the crack is.
double bound(double u, double offset, bool inside) {
  const double certain = u - kSlack - 1e-6 * u;
  if (!inside) return std::max(0.0, certain - offset);
  if (u <= offset) return std::max(0.0, offset - u - kSlack);
  return std::sqrt(std::max(0.0, certain * certain - offset * offset));
}

// What a bound may be below the distance: this [voxel], and an eighth of it. That is a tenth of a
// voxel on average over the nodes of a soup. Between nodes the engine's bound then stays within a
// voxel of the truth on average wherever exact nodes would keep it there.
constexpr double kLoose = 0.9;

constexpr double kSpacing = 8;  // of nodes [voxel]

// Where to start a search: what is known of nodes near by.
struct Start {
  double least = 1e5;  // of their distances [voxel]
  std::size_t count = 0;
  std::uint32_t place[TriangleTree::kStarts];
  // A node's distance, and where that was found or kNone.
  void add(float away, std::uint32_t nearest) {
    const bool first = double(away) < least;
    least = std::min(least, double(away));
    if (nearest == TriangleTree::kNone || count == TriangleTree::kStarts) return;
    for (std::size_t i = 0; i < count; ++i)
      if (TriangleTree::together(place[i], nearest)) return;
    place[count++] = nearest;
    if (first) std::swap(place[0], place[count - 1]);
  }
};

// Distances from below [voxel] of the nodes (8a, 8b, 8c): first those of even a, b and c, by
// layers.
class Nodes {
 public:
  Nodes(const Grid& grid, const TriangleTree& tree) : tree_(tree) {
    for (std::size_t k = 0; k < 3; ++k) {
      count_[k] = grid.bricks[k] + 1;
      even_[k] = std::size_t(grid.bricks[k] / 2 + 1);
    }
    away_.resize(even_[0] * even_[1] * even_[2]);
    nearest_.resize(away_.size());
  }
  int count(std::size_t k) const { return count_[k]; }
  std::size_t even(std::size_t k) const { return even_[k]; }

  // In the order of a, then b: each is looked for around what those before it found. `known`: the
  // distance if no search is needed, else negative.
  void search_even(int a, int b, int c, double known) {
    const std::size_t i = at(a, b, c), row = even_[0];
    nearest_[i] = TriangleTree::kNone;
    Start start;
    if (a > 0) start.add(away_[i - 1], nearest_[i - 1]);
    if (b > 0) start.add(away_[i - row], nearest_[i - row]);
    if (b > 0 && a + 2 < count_[0]) start.add(away_[i - row + 1], nearest_[i - row + 1]);
    const double away = known >= 0
                            ? certain(known)
                            : search(a, b, c, start, std::sqrt(8.0) * kSpacing, -1, nearest_[i]);
    away_[i] = std::nextafter(float(away), 0.0f);
  }

  // Of any node, when all the even ones around it are known.
  double away(int a, int b, int c, double known) const {
    if (known >= 0) return certain(known);
    const int odd[3] = {a & 1, b & 1, c & 1}, axes = odd[0] + odd[1] + odd[2];
    if (axes == 0) return double(away_[at(a, b, c)]);
    Start start;
    double squares[8];
    int corners = 0;  // some at the end of the field are missing
    for (int z = c - odd[2]; z <= c + odd[2]; z += 2)
      for (int y = b - odd[1]; y <= b + odd[1]; y += 2)
        for (int x = a - odd[0]; x <= a + odd[0]; x += 2) {
          if (x >= count_[0] || y >= count_[1] || z >= count_[2]) continue;
          const std::size_t i = at(x, y, z);
          start.add(away_[i], nearest_[i]);
          squares[corners++] = double(away_[i]) * double(away_[i]);
        }
    const double way2 = axes * kSpacing * kSpacing;
    double low2 = -1;
    if (corners == 1 << axes)
      for (int i = 0; i < corners / 2; ++i)
        low2 = std::max(low2, (squares[i] + squares[corners - 1 - i]) / 2 - way2);
    const double low = std::sqrt(std::max(0.0, low2));
    const double enough = low2 > 0 ? low + std::min(kLoose, low / 8) : -1;
    std::uint32_t nearest;
    return std::max(low, search(a, b, c, start, std::sqrt(way2), enough, nearest));
  }

 private:
  static double certain(double u) { return std::max(0.0, u - kSlack - 1e-6 * u); }
  std::size_t at(int a, int b, int c) const {
    return (std::size_t(c / 2) * even_[1] + std::size_t(b / 2)) * even_[0] + std::size_t(a / 2);
  }
  // `way`: to the nodes of `start`; a distance grows by it at most. 0 where something is `enough`
  // near.
  double search(int a, int b, int c, const Start& start, double way, double enough,
                std::uint32_t& nearest) const {
    const double p[3] = {kSpacing * a, kSpacing * b, kSpacing * c};
    const double most = start.least + way + 0.1;
    TriangleTree::Found found{float(most * most), TriangleTree::kNone, 0};
    const double away = tree_.search(p, {start.place, start.count}, enough, found);
    nearest = found.place;
    return away;
  }

  const TriangleTree& tree_;
  int count_[3];
  std::size_t even_[3];
  std::vector<float> away_;             // (even nodes)
  std::vector<std::uint32_t> nearest_;  // (even nodes) place in the tree, or kNone
};

}  // namespace

Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps,
                      std::vector<float>& far) {
  const TriangleTree tree(surface, grid, threads);
  if (!steps.tell("far field", 0.88)) return Failure{"cancelled"};
  Nodes nodes(grid, tree);
  const auto known_of = [&](int a, int b, int c) { return look_up(grid, band, reached, a, b, c); };
  if (!steps.run("far field", 0.88, 0.92, nodes.even(2), threads, [&](std::size_t layer) {
        const int c = int(2 * layer);
        for (int b = 0; b < nodes.count(1); b += 2)
          for (int a = 0; a < nodes.count(0); a += 2)
            nodes.search_even(a, b, c, known_of(a, b, c).u);
      }))
    return Failure{"cancelled"};
  const int nx = nodes.count(0), ny = nodes.count(1), nz = nodes.count(2);
  far.resize(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  if (!steps.run("far field", 0.92, 1.0, std::size_t(nz), threads, [&](std::size_t layer) {
        float* to = far.data() + layer * std::size_t(ny) * std::size_t(nx);
        const int c = int(layer);
        for (int b = 0; b < ny; ++b)
          for (int a = 0; a < nx; ++a) {
            const Known known = known_of(a, b, c);
            const double u = bound(nodes.away(a, b, c, known.u), grid.offset, known.inside);
            *to++ = float((known.inside ? -u : u) * grid.voxel * (1 - 1e-6));
          }
      }))
    return Failure{"cancelled"};
  return Done{};
}

}  // namespace h6::io::bake
