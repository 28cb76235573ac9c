// SPDX-License-Identifier: Apache-2.0
// bend_sums_ref.cpp - the specification of reduced_force and sum_rows.
#include <algorithm>

#include "kernels/bend/bend_sums.h"

namespace h6::kernels {

void reduced_force_ref(const ReducedForce& polynomial, const double* q, double* force,
                       double* tangent) {
  const std::size_t r = polynomial.count, padded = polynomial.padded();
  std::fill_n(force, padded, 0.0);
  std::fill_n(tangent, r * padded, 0.0);
  const double* at = polynomial.coefficients;
  for (std::size_t first = 0; first < padded; first += kForceLanes) {
    const auto add = [&](double* column, double factor) {
      for (std::size_t i = 0; i < kForceLanes; ++i) column[first + i] += factor * at[i];
    };
    const auto d = [&](std::size_t mode) { return tangent + mode * padded; };
    for (std::size_t j = 0; j < r; ++j, at += kForceLanes) {
      add(force, q[j]);
      add(d(j), 1);
    }
    if (polynomial.linear) continue;
    for (std::size_t j = 0; j < r; ++j)
      for (std::size_t k = j; k < r; ++k, at += kForceLanes) {
        add(force, q[j] * q[k]);
        add(d(j), q[k]);
        add(d(k), q[j]);
      }
    for (std::size_t j = 0; j < r; ++j)
      for (std::size_t k = j; k < r; ++k)
        for (std::size_t l = k; l < r; ++l, at += kForceLanes) {
          add(force, q[j] * q[k] * q[l]);
          add(d(j), q[k] * q[l]);
          add(d(k), q[j] * q[l]);
          add(d(l), q[j] * q[k]);
        }
  }
}

template <class T>
void sum_rows_ref(const RowSumsT<T>& rows, double* force, double* matrix) {
  std::fill_n(force, rows.stride, 0.0);
  std::fill_n(matrix, rows.size * rows.stride, 0.0);
  for (std::size_t i = 0; i < rows.count; ++i)
    for (std::size_t a = 0; a < rows.stride; ++a) {
      const double left = double{rows.left[i * rows.stride + a]};
      force[a] += double{rows.load[i]} * left;
      if (a >= rows.size) continue;
      for (std::size_t b = 0; b < rows.stride; ++b)
        matrix[a * rows.stride + b] +=
            double{rows.share[i]} * left * double{rows.right[i * rows.stride + b]};
    }
}

template void sum_rows_ref(const RowSumsT<float>&, double*, double*);
template void sum_rows_ref(const RowSumsT<double>&, double*, double*);

}  // namespace h6::kernels
