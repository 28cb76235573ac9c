// SPDX-License-Identifier: Apache-2.0
// series_solve_ref.cpp - the specification of series_solve, in double.
#include <algorithm>

#include "kernels/weights/series_newton.h"

namespace h6::kernels {
namespace {

// [N; (r x N)/L]
template <class T>
void scaled_axis(const SeriesColumnsT<T>& c, double lever, std::size_t i, double J[6]) {
  const double n[3] = {double{c.nx[i]}, double{c.ny[i]}, double{c.nz[i]}};
  const double r[3] = {double{c.rx[i]}, double{c.ry[i]}, double{c.rz[i]}};
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    J[k] = n[k];
    J[3 + k] = (r[l] * n[m] - r[m] * n[l]) / lever;
  }
}

template <class T>
double kappa_of(const SeriesColumnsT<T>& c, const SeriesParameters& p, std::size_t i) {
  double J[6];
  scaled_axis(c, p.lever, i, J);
  const double facing = c.facing ? double{c.facing[i]} : 1.0;
  return facing / (1 - std::min(norm2(J), 2.0) / p.c);
}

template <class T>
double slack_at(const SeriesColumnsT<T>& c, const SeriesParameters& p, std::size_t i,
                const double y[6], double J[6]) {
  scaled_axis(c, p.lever, i, J);
  double u = double{c.e[i]};
  for (int k = 0; k < 6; ++k) u -= J[k] * y[k];
  return u;
}

}  // namespace

template <class T>
SeriesResult series_solve_ref(const SeriesColumnsT<T>& c, const SeriesParameters& p, double y[6],
                              T* kappa, T* slack) {
  double max_e = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    kappa[i] = static_cast<T>(kappa_of(c, p, i));
    if (kappa[i] > 0) max_e = std::max(max_e, double{c.e[i]});
  }
  SeriesResult result{0, 0};
  if (max_e > 0) {
    check_start(y);
    const auto sums_at = [&](const double* at, bool) {
      SeriesSums sums;
      for (std::size_t i = 0; i < c.count; ++i) {
        double J[6];
        const double u = slack_at(c, p, i, at, J);
        if (!(u > 0)) continue;
        const double w = double{kappa[i]}, t = p.touch;
        const double stiff = u < t ? w * u / t : w;
        const double load = u < t ? w * u * u / (2 * t) : w * (u - t / 2);
        int entry = 0;
        for (int row = 0; row < 6; ++row) {
          sums.pull[row] += load * J[row];
          for (int col = row; col < 6; ++col) sums.system[entry++] += stiff * J[row] * J[col];
        }
        sums.energy += u < t ? w * u * u * u / (3 * t) : w * ((u - t) * u + t * t / 3);
      }
      return sums;
    };
    result = newton(p, max_e, y, sums_at(y, true), sums_at);
  } else {
    std::fill_n(y, 6, 0.0);  // no contact has load
  }
  for (std::size_t i = 0; i < c.count; ++i) {
    double J[6];
    slack[i] = static_cast<T>(std::max(0.0, slack_at(c, p, i, y, J)));
  }
  return result;
}

template SeriesResult series_solve_ref(const SeriesColumnsT<float>&, const SeriesParameters&,
                                       double*, float*, float*);
template SeriesResult series_solve_ref(const SeriesColumnsT<double>&, const SeriesParameters&,
                                       double*, double*, double*);

}  // namespace h6::kernels
