// SPDX-License-Identifier: Apache-2.0
// bend_sums.cpp - the SIMD twin of bend_sums_ref.cpp. Lanes are doubles.
#include "kernels/bend/bend_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bend/bend_sums.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DD = hn::CappedTag<double, kForceLanes>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;

HWY_INLINE void add_to(double* at, VD value) {
  const DD d;
  hn::StoreU(hn::Add(hn::LoadU(d, at), value), d, at);
}

// The components in one register. A coefficient of degree 3 is read once: its product with q_l goes
// to a sum over l, its product with q_j q_k to the column of l; the sum gives the rest.
HWY_INLINE void force_lanes(const double* at, bool linear, std::size_t r, std::size_t padded,
                            const double* q, double* force, double* tangent) {
  const DD d;
  const auto next = [&at, d]() HWY_ATTR {
    const VD value = hn::LoadU(d, at);
    at += kForceLanes;
    return value;
  };
  VD total = hn::Zero(d);
  for (std::size_t j = 0; j < r; ++j) {
    const VD c = next();
    total = hn::MulAdd(c, hn::Set(d, q[j]), total);
    hn::StoreU(c, d, tangent + j * padded);
  }
  if (linear) return hn::StoreU(total, d, force);
  for (std::size_t j = 0; j < r; ++j) {
    const VD qj = hn::Set(d, q[j]);
    VD sum = hn::Zero(d);
    for (std::size_t k = j; k < r; ++k) {
      const VD c = next();
      sum = hn::MulAdd(c, hn::Set(d, q[k]), sum);
      add_to(tangent + k * padded, hn::Mul(c, qj));
    }
    total = hn::MulAdd(sum, qj, total);
    add_to(tangent + j * padded, sum);
  }
  for (std::size_t j = 0; j < r; ++j) {
    const VD qj = hn::Set(d, q[j]);
    VD of_j = hn::Zero(d);
    for (std::size_t k = j; k < r; ++k) {
      const VD qk = hn::Set(d, q[k]), both = hn::Mul(qj, qk);
      VD sum = hn::Zero(d);
      double* column = tangent + k * padded;
      for (std::size_t l = k; l < r; ++l, column += padded) {
        const VD c = next();
        sum = hn::MulAdd(c, hn::Set(d, q[l]), sum);
        hn::StoreU(hn::MulAdd(c, both, hn::LoadU(d, column)), d, column);
      }
      total = hn::MulAdd(sum, both, total);
      of_j = hn::MulAdd(sum, qk, of_j);
      add_to(tangent + k * padded, hn::Mul(sum, qj));
    }
    add_to(tangent + j * padded, of_j);
  }
  hn::StoreU(total, d, force);
}

void force_simd(const ReducedForce& p, const double* q, double* force, double* tangent) {
  const std::size_t padded = p.padded();
  for (std::size_t first = 0; first < padded; first += kForceLanes)
    for (std::size_t lane = 0; lane < kForceLanes; lane += hn::Lanes(DD()))
      force_lanes(p.coefficients + first * p.monomials() + lane, p.linear, p.count, padded, q,
                  force + first + lane, tangent + first + lane);
}

constexpr std::size_t kAtOnce = 4, kMostStride = 72;  // rows added at a time; values of a row

// Adds `count` rows, at most kAtOnce; the others count as zeros.
HWY_INLINE void add_rows(const RowSums& rows, std::size_t first, std::size_t count, double* force,
                         double* matrix) {
  const DD d;
  HWY_ALIGN double left[kAtOnce][kMostStride], right[kAtOnce][kMostStride];
  double load[kAtOnce];
  for (std::size_t k = 0; k < kAtOnce; ++k) {
    const bool live = k < count;
    load[k] = live ? double{rows.load[first + k]} : 0.0;
    const VD share = hn::Set(d, live ? double{rows.share[first + k]} : 0.0);
    const std::size_t at = (live ? first + k : first) * rows.stride;
    for (std::size_t b = 0; b < rows.stride; b += hn::Lanes(d)) {
      hn::Store(hn::PromoteTo(d, hn::LoadU(DF(), rows.left + at + b)), d, left[k] + b);
      const VD value = hn::PromoteTo(d, hn::LoadU(DF(), rows.right + at + b));
      hn::Store(hn::Mul(share, value), d, right[k] + b);
    }
  }
  const auto add = [&](const double f[kAtOnce], const double(*columns)[kMostStride], double* out)
                       HWY_ATTR {
                         for (std::size_t b = 0; b < rows.stride; b += hn::Lanes(d)) {
                           VD sum = hn::LoadU(d, out + b);
                           HWY_UNROLL(4)
                           for (std::size_t k = 0; k < kAtOnce; ++k)
                             sum = hn::MulAdd(hn::Set(d, f[k]), hn::Load(d, columns[k] + b), sum);
                           hn::StoreU(sum, d, out + b);
                         }
                       };
  add(load, left, force);
  for (std::size_t a = 0; a < rows.size; ++a) {
    const double f[kAtOnce] = {left[0][a], left[1][a], left[2][a], left[3][a]};
    add(f, right, matrix + a * rows.stride);
  }
}

void sum_simd(const RowSums& rows, double* force, double* matrix) {
  for (std::size_t b = 0; b < rows.stride; ++b) force[b] = 0;
  for (std::size_t b = 0; b < rows.size * rows.stride; ++b) matrix[b] = 0;
  for (std::size_t i = 0; i < rows.count; i += kAtOnce)
    add_rows(rows, i, HWY_MIN(kAtOnce, rows.count - i), force, matrix);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(force_simd);
HWY_EXPORT(sum_simd);

void reduced_force(const ReducedForce& polynomial, const double* q, double* force,
                   double* tangent) {
  HWY_DYNAMIC_DISPATCH(force_simd)(polynomial, q, force, tangent);
}
void sum_rows(const RowSums& rows, double* force, double* matrix) {
  HWY_DYNAMIC_DISPATCH(sum_simd)(rows, force, matrix);
}

}  // namespace h6::kernels
#endif
