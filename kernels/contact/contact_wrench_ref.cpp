// SPDX-License-Identifier: Apache-2.0
// contact_wrench_ref.cpp - the specification of contact_wrench, in double.
#include "kernels/contact/contact_wrench.h"

namespace h6::kernels {
namespace {

// [v; r x v]
template <class T>
void wrench_axis(const T* const v[3], const T* const r[3], std::size_t i, double out[6]) {
  const double a[3] = {double{v[0][i]}, double{v[1][i]}, double{v[2][i]}};
  const double b[3] = {double{r[0][i]}, double{r[1][i]}, double{r[2][i]}};
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    out[k] = a[k];
    out[3 + k] = b[l] * a[m] - b[m] * a[l];
  }
}

}  // namespace

void WrenchSum::add(const WrenchSum& other) {
  for (int k = 0; k < 6; ++k) {
    force[k] += other.force[k];
    elastic[k] += other.elastic[k];
  }
  for (int k = 0; k < 36; ++k) {
    stiffness[k] += other.stiffness[k];
    damping[k] += other.damping[k];
  }
}

template <class T>
WrenchSum contact_wrench_ref(const WrenchColumnsT<T>& c, const WrenchParameters& p,
                             std::size_t begin, std::size_t end) {
  const T* const normal[3] = {c.nx, c.ny, c.nz};
  const T* const gradient[3] = {c.gx, c.gy, c.gz};
  const T* const arm[3] = {c.rx, c.ry, c.rz};
  WrenchSum sum;
  for (std::size_t i = begin; i < end; ++i) {
    double J[6], Jg[6];
    wrench_axis(normal, arm, i, J);
    wrench_axis(p.exact ? gradient : normal, arm, i, Jg);

    double approach = 0;  // J.u
    for (int k = 0; k < 6; ++k) approach += J[k] * p.velocity[k];
    const double depth = double{c.depth[i]};
    const double e = depth - p.damping * approach;
    if (!(e > 0)) continue;  // would pull

    const double kw = p.stiffness * double{c.weight[i]};
    for (int row = 0; row < 6; ++row) {
      sum.force[row] += kw * e * J[row];  // Eq. (1), (9) and damping
      sum.elastic[row] += kw * depth * J[row];
      for (int col = 0; col < 6; ++col) {
        sum.stiffness[6 * row + col] += kw * J[row] * Jg[col];
        sum.damping[6 * row + col] += kw * J[row] * J[col];
      }
    }
  }
  return sum;
}

template WrenchSum contact_wrench_ref(const WrenchColumnsT<float>&, const WrenchParameters&,
                                      std::size_t, std::size_t);
template WrenchSum contact_wrench_ref(const WrenchColumnsT<double>&, const WrenchParameters&,
                                      std::size_t, std::size_t);

}  // namespace h6::kernels
