// SPDX-License-Identifier: Apache-2.0
// bend_sums.h - the sums of a body that bends: its internal force with the tangent, and the forces
// and gradients of its contacts. METHOD.md, Sec. 10.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// The reduced internal force, a cubic polynomial of q, in blocks of 8 components: of block b, the
// coefficients of each monomial for components 8b .. 8b+7 stand together, monomials in
// lexicographic order (j; j <= k; j <= k <= l). Components from count on are zeros.
//     block b: [count][8], [count (count+1)/2][8], [count (count+1) (count+2)/6][8]
// A linear force has the first of these only.
inline constexpr std::size_t kForceLanes = 8;
struct ReducedForce {
  const double* coefficients;
  std::size_t count;    // r
  bool linear = false;  // there is nothing behind degree 1
  std::size_t padded() const { return (count + kForceLanes - 1) / kForceLanes * kForceLanes; }
  std::size_t monomials() const {
    if (linear) return count;
    return count + count * (count + 1) / 2 + count * (count + 1) * (count + 2) / 6;
  }
};
// force (padded): f(q). tangent (count x padded): column m is df/dq_m. Barbic & James 2005, Sec. 3.
void reduced_force(const ReducedForce& polynomial, const double* q, double* force, double* tangent);
void reduced_force_ref(const ReducedForce& polynomial, const double* q, double* force,
                       double* tangent);

// Sums over rows i in order, `stride` (a multiple of 8) values each:
//     force[a] = sum load_i left_i[a]       matrix[a stride + b] = sum share_i left_i[a] right_i[b]
// Rows of `matrix` from `size` on are not written.
template <class T>
struct RowSumsT {
  const T *left, *right;  // (count x stride); may be the same
  const T *load, *share;  // (count)
  std::size_t count, size, stride;
};
using RowSums = RowSumsT<float>;
void sum_rows(const RowSums& rows, double* force, double* matrix);
template <class T>
void sum_rows_ref(const RowSumsT<T>& rows, double* force, double* matrix);

}  // namespace h6::kernels
