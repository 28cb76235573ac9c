// bake_far.cpp - how far every eighth node is from the surface at least.
//
// Nodes near the surface are known already. The others are searched with the triangles around the
// one that was nearest to the node before as a start, which nearly always have the nearest again or
// one close to it: what is left is to see that no other is nearer.
#include <algorithm>

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

// The nodes of one layer in order, each started from what its neighbours found.
class Layer {
 public:
  Layer(const TriangleTree& tree, int nx)
      : tree_(tree), away_(std::size_t(nx), kUnknown), nearest_(std::size_t(nx), kNone) {}

  // The distance of node (8a, 8b, 8c), which is `known` unless that is negative.
  double next(int a, int b, int c, double known) {
    const std::size_t i = std::size_t(a);
    if (known >= 0) {
      nearest_[i] = kNone;
      return away_[i] = known;
    }
    const double p[3] = {8.0 * a, 8.0 * b, 8.0 * c};
    // Behind in this line, and beside it in the line before: a distance grows by 8 at most.
    double most = away_[i];
    if (a > 0) most = std::min(most, away_[i - 1]);
    most += 8.1;
    TriangleTree::Found found{float(most * most), kNone, 0};
    const std::uint32_t start[TriangleTree::kStarts] = {
        a > 0 ? nearest_[i - 1] : kNone, nearest_[i],
        i + 1 < nearest_.size() ? nearest_[i + 1] : kNone};
    away_[i] = tree_.search(p, start, found);
    nearest_[i] = found.place;
    return away_[i];
  }

 private:
  static constexpr double kUnknown = 1e5;
  static constexpr std::uint32_t kNone = TriangleTree::kNone;
  const TriangleTree& tree_;
  std::vector<double> away_;            // by a: of this line so far, then of the line before
  std::vector<std::uint32_t> nearest_;  // likewise
};

}  // namespace

Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps,
                      std::vector<float>& far) {
  const TriangleTree tree(surface, grid, threads);
  if (!steps.tell("far field", 0.88)) return Failure{"cancelled"};
  const int nx = grid.bricks[0] + 1, ny = grid.bricks[1] + 1, nz = grid.bricks[2] + 1;
  far.resize(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  const bool whole = steps.run("far field", 0.88, 1.0, std::size_t(nz), threads,
                               [&](std::size_t c) {
    Layer layer(tree, nx);
    for (int b = 0; b < ny; ++b)
      for (int a = 0; a < nx; ++a) {
        const Known known = look_up(grid, band, reached, a, b, int(c));
        const double away = layer.next(a, b, int(c), known.u);
        const double u = bound(away, grid.offset, known.inside);
        far[(c * std::size_t(ny) + std::size_t(b)) * std::size_t(nx) + std::size_t(a)] =
            float((known.inside ? -u : u) * grid.voxel * (1 - 1e-6));
      }
  });
  if (!whole) return Failure{"cancelled"};
  return Done{};
}

}  // namespace h6::io::bake
