// SPDX-License-Identifier: Apache-2.0
// friction_rows_ref.cpp - the specification of friction_rows, in double.
#include <algorithm>
#include <cmath>

#include "kernels/contact/friction_rows.h"

namespace h6::kernels {
namespace {

struct Row {
  double n[3], r[3];
};
template <class T>
Row row_at(const FrictionRowsT<T>& rows, std::size_t i) {
  Row row{{rows.nx[i], rows.ny[i], rows.nz[i]}, {rows.rx[i], rows.ry[i], rows.rz[i]}};
  // A step of Newton's method makes the unit vector of floats one of doubles.
  const double scale =
      1.5 - 0.5 * (row.n[0] * row.n[0] + row.n[1] * row.n[1] + row.n[2] * row.n[2]);
  for (double& n : row.n) n *= scale;
  return row;
}

void moved_by(const double q[6], const double r[3], double out[3]) {
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    out[k] = q[k] + q[3 + l] * r[m] - q[3 + m] * r[l];
  }
}
double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// n.(d + theta x r)
double along(const Row& row, const double q[6]) {
  double moved[3];
  moved_by(q, row.r, moved);
  return dot(row.n, moved);
}
double stretch_of(const Row& row, bool line, const double q[6]) {
  const double way = along(row, q);
  if (line) return std::max(way, 0.0);
  double z[3];
  moved_by(q, row.r, z);
  for (int k = 0; k < 3; ++k) z[k] -= way * row.n[k];
  return std::sqrt(dot(z, z));
}

}  // namespace

PushLineRows push_lines_ref(const ContactColumns& c, const float* pressed, const PushLines& out) {
  PushLineRows rows{};
  for (std::size_t i = 0; i < c.count; ++i) {
    const double n[3] = {c.nx[i], c.ny[i], c.nz[i]}, g[3] = {c.gx[i], c.gy[i], c.gz[i]};
    const double x = n[1] * g[2] - n[2] * g[1], y = n[2] * g[0] - n[0] * g[2];
    const double z = n[0] * g[1] - n[1] * g[0];
    const double sine = std::sqrt(x * x + y * y + z * z), cosine = dot(n, g);
    const double t = sine > 0 ? sine / std::max(sine / kMostRub, cosine) : 0;
    const double lean = t * std::clamp(t / kNoLean - 1, 0.0, 1.0);
    const auto load = static_cast<float>(lean * std::max(double{pressed[i]}, 0.0));
    if (!(load > 0)) continue;
    float* const e[3] = {out.ex, out.ey, out.ez};
    for (int k = 0; k < 3; ++k)
      e[k][rows.count] = static_cast<float>((n[k] * cosine - g[k]) / sine);
    out.rx[rows.count] = c.rx[i], out.ry[rows.count] = c.ry[i], out.rz[rows.count] = c.rz[i];
    out.load[rows.count++] = load;
    rows.total += double{load};
  }
  return rows;
}

template <class T>
void friction_stretch_ref(const FrictionRowsT<T>& rows, const double q[6], double* stretch) {
  for (std::size_t i = 0; i < rows.count; ++i)
    stretch[i] = stretch_of(row_at(rows, i), rows.lines, q);
}

FrictionSums friction_sums_ref(const float* load, const double* stretch, std::size_t count,
                               double share, double limit) {
  FrictionSums sums{};
  for (std::size_t i = 0; i < count; ++i) {
    const double z = share * stretch[i], c = std::min(z, limit), l = double{load[i]};
    if (!(l > 0)) continue;
    if (z > 0) sums.stretched += l;
    if (z < limit) sums.sticking += l * z;
    sums.linear += l * z;
    sums.capped += l * c;
    sums.energy += l * c * (z - 0.5 * c);
    sums.slips = sums.slips || z > limit;
  }
  return sums;
}

template <class T>
void friction_stiffness_ref(const FrictionRowsT<T>& rows, const FrictionSecant& secant,
                            const double q[6], const double ahead[6], double K[36]) {
  for (std::size_t i = 0; i < rows.count; ++i) {
    const Row row = row_at(rows, i);
    if (!(rows.load[i] > 0) || (rows.lines && along(row, q) < 0)) continue;
    const double z = std::max(stretch_of(row, rows.lines, q), stretch_of(row, rows.lines, ahead));
    const double s = secant.scale * rows.load[i] / std::max(secant.limit, z);
    double J[3][6];  // column by column
    for (int col = 0; col < 6; ++col) {
      double unit[6] = {}, moved[3];
      unit[col] = 1;
      moved_by(unit, row.r, moved);
      for (int k = 0; k < 3; ++k) J[k][col] = moved[k];
    }
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b) {
        double in_line = 0, all = 0, na = 0, nb = 0;
        for (int k = 0; k < 3; ++k) {
          all += J[k][a] * J[k][b];
          na += row.n[k] * J[k][a], nb += row.n[k] * J[k][b];
        }
        in_line = na * nb;
        K[6 * a + b] += s * (rows.lines ? in_line : all - in_line);
      }
  }
}

template void friction_stretch_ref(const FrictionRowsT<float>&, const double*, double*);
template void friction_stretch_ref(const FrictionRowsT<double>&, const double*, double*);
template void friction_stiffness_ref(const FrictionRowsT<float>&, const FrictionSecant&,
                                     const double*, const double*, double*);
template void friction_stiffness_ref(const FrictionRowsT<double>&, const FrictionSecant&,
                                     const double*, const double*, double*);

}  // namespace h6::kernels
