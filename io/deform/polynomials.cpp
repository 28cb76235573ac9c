// SPDX-License-Identifier: Apache-2.0
#include "io/deform/polynomials.h"

#include <algorithm>
#include <cmath>

#include "sched/parallel_for.h"

namespace h6::io::deform {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;

constexpr Index kPointsAtOnce = 256;  // 6 rows each: the panel stays in cache
constexpr Index kTile = 128;          // columns of a tile of the Gram matrix

// sqrt(C) of an isotropic stress law on (xx, yy, zz, r2 xy, r2 xz, r2 yz), r2 = sqrt(2), whose dot
// product is a:b. C multiplies the deviator by 2 mu and the trace by 3 lambda + 2 mu.
struct RootLaw {
  explicit RootLaw(const Lame& c)
      : shear(std::sqrt(2 * c.mu)), bulk((std::sqrt(3 * c.lambda + 2 * c.mu) - shear) / 3) {}
  double shear, bulk;

  // The root times the symmetric part of m and `scale`.
  void put(const Matrix3d& m, double scale, double* out) const {
    const double trace = bulk * (m(0, 0) + m(1, 1) + m(2, 2));
    constexpr double half_root = 0.70710678118654752440;
    out[0] = scale * (shear * m(0, 0) + trace);
    out[1] = scale * (shear * m(1, 1) + trace);
    out[2] = scale * (shear * m(2, 2) + trace);
    out[3] = scale * shear * half_root * (m(0, 1) + m(1, 0));
    out[4] = scale * shear * half_root * (m(0, 2) + m(2, 0));
    out[5] = scale * shear * half_root * (m(1, 2) + m(2, 1));
  }
};

// Sums B^T B panel by panel. Each tile of it belongs to one task, so the order of every sum is
// fixed.
class Gram {
 public:
  Gram(Index columns, unsigned threads)
      : sum_(MatrixXd::Zero(columns, columns)),
        panel_(6 * kPointsAtOnce, columns),
        threads_(threads) {
    for (Index j = 0; j < columns; j += kTile)
      for (Index i = j; i < columns; i += kTile) tiles_.push_back({i, j});
  }
  double* next(Index column) { return &panel_(6 * points_, column); }
  void take() {
    if (++points_ == kPointsAtOnce) flush();
  }
  void flush() {
    const auto rows = panel_.topRows(6 * points_);
    sched::parallel_for(tiles_.size(), threads_, [&](std::size_t t) {
      const auto [i, j] = tiles_[t];
      const Index high = std::min(kTile, sum_.rows() - i), wide = std::min(kTile, sum_.cols() - j);
      sum_.block(i, j, high, wide).noalias() +=
          rows.middleCols(i, high).transpose() * rows.middleCols(j, wide);
    });
    points_ = 0;
  }
  double operator()(Index a, Index b) const { return a >= b ? sum_(a, b) : sum_(b, a); }

 private:
  struct Tile {
    Index row, column;
  };
  MatrixXd sum_, panel_;
  std::vector<Tile> tiles_;
  unsigned threads_;
  Index points_ = 0;
};

// The columns of a point: L_i, then Q_ij for i <= j.
void add_point(const std::vector<Matrix3d>& g, const RootLaw& law, double weight, Gram& gram) {
  const double root = std::sqrt(weight);
  Index column = 0;
  for (const Matrix3d& a : g) law.put(a, root, gram.next(column++));
  for (std::size_t i = 0; i < g.size(); ++i)
    for (std::size_t j = i; j < g.size(); ++j) {
      const Matrix3d both = g[i].transpose() * g[j];
      law.put(both, root, gram.next(column++));
    }
  gram.take();
}

// Row i of the coefficients. A pair or triple collects the products of all orders of its indices.
void put_row(const Gram& gram, std::size_t i, ReducedModel& model) {
  const std::size_t r = model.modes;
  const auto q = [r](std::size_t a, std::size_t b) {
    return static_cast<Index>(r + pair_place(r, std::min(a, b), std::max(a, b)));
  };
  double* p1 = model.linear.data() + i * r;
  double* p2 = model.quadratic.data() + i * pair_count(r);
  double* p3 = model.cubic.data() + i * triple_count(r);
  const auto row = static_cast<Index>(i);
  for (std::size_t j = 0; j < r; ++j) {
    p1[j] = gram(row, static_cast<Index>(j));
    for (std::size_t k = 0; k < r; ++k) {
      const double share = k < j ? 0 : k == j ? 0.5 : 1;
      const std::size_t place = pair_place(r, std::min(j, k), std::max(j, k));
      p2[place] += gram(q(i, j), static_cast<Index>(k));
      if (share > 0) p2[place] += share * gram(row, q(j, k));
      for (std::size_t l = k; l < r; ++l) {
        std::size_t at[3] = {j, k, l};
        std::sort(at, at + 3);
        p3[triple_place(r, at[0], at[1], at[2])] += (k == l ? 0.5 : 1) * gram(q(i, j), q(k, l));
      }
    }
  }
}

}  // namespace

bool make_polynomials(const SolidMesh& mesh, const Dofs& dofs, const MatrixXd& basis,
                      unsigned threads, ReducedModel& model, Pulse& pulse) {
  const auto r = static_cast<std::size_t>(basis.cols());
  Gram gram(static_cast<Index>(r + pair_count(r)), threads);
  std::vector<Matrix3d> g(r);
  std::vector<Corners> corners(r);
  for (std::size_t n = 0; n < mesh.elements.size(); ++n) {
    if (!pulse.alive()) return false;
    pulse.share(static_cast<double>(n) / static_cast<double>(mesh.elements.size()));
    const SolidElement& e = mesh.elements[n];
    const RootLaw law(lame(mesh.materials[e.material]));
    const Quadrature points = quadrature(mesh, e);
    for (std::size_t i = 0; i < r; ++i)
      corners[i] = corners_of(e, dofs, basis.col(static_cast<Index>(i)));
    for (std::size_t p = 0; p < points.count; ++p) {
      for (std::size_t i = 0; i < r; ++i) g[i] = gradient_of(e, points.point[p], corners[i]);
      add_point(g, law, points.point[p].weight, gram);
    }
  }
  gram.flush();
  model.modes = r;
  model.linear.assign(r * r, 0);
  model.quadratic.assign(r * pair_count(r), 0);
  model.cubic.assign(r * triple_count(r), 0);
  sched::parallel_for(r, threads, [&](std::size_t i) { put_row(gram, i, model); });
  return true;
}

}  // namespace h6::io::deform
