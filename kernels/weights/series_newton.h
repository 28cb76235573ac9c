// SPDX-License-Identifier: Apache-2.0
// series_newton.h - Newton's method of series_solve, for any implementation of the sums over
// contacts.
#pragma once
#include <cmath>

#include "kernels/weights/series_solve.h"

namespace h6::kernels {

inline constexpr int kUpper6 =
    21;  // entries of a symmetric 6 x 6 matrix, row by row from the diagonal

// Sums over the contacts that are active at y.
struct SeriesSums {
  double system[kUpper6] = {};  // sum kappa p' J J^T
  double pull[6] = {};          // sum kappa p J
  double energy = 0;            // 2 sum kappa P
};

// Solves (c I + system) x = b by Cholesky: the matrix is at least c I, so no pivot vanishes.
inline void solve_spring_system(double c, const double system[kUpper6], const double b[6],
                                double x[6]) {
  double l[6][6];
  int at = 0;
  for (int row = 0; row < 6; ++row)
    for (int col = row; col < 6; ++col) l[col][row] = system[at++];
  for (int j = 0; j < 6; ++j) {
    for (int i = j; i < 6; ++i) {
      double v = l[i][j] + (i == j ? c : 0.0);
      for (int k = 0; k < j; ++k) v -= l[i][k] * l[j][k];
      l[i][j] = i == j ? std::sqrt(v) : v / l[j][j];
    }
  }
  for (int i = 0; i < 6; ++i) {
    x[i] = b[i];
    for (int k = 0; k < i; ++k) x[i] -= l[i][k] * x[k];
    x[i] /= l[i][i];
  }
  for (int i = 5; i >= 0; --i) {
    for (int k = i + 1; k < 6; ++k) x[i] -= l[k][i] * x[k];
    x[i] /= l[i][i];
  }
}

inline double norm2(const double v[6]) {
  double sum = 0;
  for (int k = 0; k < 6; ++k) sum += v[k] * v[k];
  return sum;
}

// When no gap changes by much more than this share of the largest e, few contacts change between
// active and inactive: the step is likely the last. With a touch the stiffness of contacts changes
// within shorter steps too, and where another step follows, it costs one pass more.
inline constexpr double kLastStep = 0.1;

// Newton's step from y, where the sums are `now`.
inline void newton_step(double c, const SeriesSums& now, const double y[6], double step[6]) {
  double gradient[6];
  for (int k = 0; k < 6; ++k) gradient[k] = now.pull[k] - c * y[k];
  solve_spring_system(c, now.system, gradient, step);
}

// `now`: the sums at y, which is finite. sums(y, system) returns SeriesSums at y, with the system
// only if `system` is set. max_e > 0 is the largest e. The number of passes over the contacts is
// bounded, so that no frame can stall here.
template <class Sums>
SeriesResult newton(const SeriesParameters& p, double max_e, double y[6], SeriesSums now,
                    const Sums& sums) {
  constexpr int kHalvings = 6;
  const double last = kLastStep * max_e;
  const double scale = p.c * max_e;
  SeriesResult result{0, 0};
  bool system = true;
  for (;;) {
    double gradient[6], step[6];
    for (int k = 0; k < 6; ++k) gradient[k] = now.pull[k] - p.c * y[k];
    result.residual = std::sqrt(norm2(gradient)) / scale;
    if (!(result.residual > p.tolerance) || result.iterations >= p.iterations) return result;
    if (!system) now = sums(y, true);
    newton_step(p.c, now, y, step);
    system = norm2(step) > last * last;
    const double before = p.c * norm2(y) + now.energy;
    double trial[6], t = 1;
    SeriesSums next;
    for (int halving = 0; halving <= kHalvings; ++halving, t *= 0.5) {
      for (int k = 0; k < 6; ++k) trial[k] = y[k] + t * step[k];
      next = sums(trial, system);
      if (p.c * norm2(trial) + next.energy <= before * (1 + 1e-12)) break;
    }
    for (int k = 0; k < 6; ++k) y[k] = trial[k];
    now = next;
    ++result.iterations;
  }
}

// A start that is not finite is ignored.
inline void check_start(double y[6]) {
  if (!std::isfinite(norm2(y)))
    for (int k = 0; k < 6; ++k) y[k] = 0;
}

}  // namespace h6::kernels
