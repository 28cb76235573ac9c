// SPDX-License-Identifier: Apache-2.0
// carried-inl.h - sums over the modes of one vector, for bend_points.cpp and warp_points.cpp.
//
// Included once for each SIMD target.

// Per-target include guard.
#if defined(H6_KERNELS_CARRIED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_CARRIED_INL_H_
#undef H6_KERNELS_CARRIED_INL_H_
#else
#define H6_KERNELS_CARRIED_INL_H_
#endif

#include "hwy/highway.h"
// After highway.h.
#include "kernels/bend/bend_points.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, kBendLanes>;
using VF = hn::Vec<DF>;

// The length of three values.
HWY_INLINE VF length_of(const VF* v) {
  return hn::Sqrt(hn::MulAdd(v[0], v[0], hn::MulAdd(v[1], v[1], hn::Mul(v[2], v[2]))));
}

// The sums over the modes of lanes `lane` and on of one vector: kAxes axes times q_j, and then
// kSpreads axes times |q_j|.
template <int kAxes, int kSpreads = 0>
struct Carried {
  static constexpr int kAll = kAxes + kSpreads;
  VF axis[kAll];
  HWY_INLINE Carried(const ModesView& m, const float* q, std::size_t v, std::size_t lane) {
    const DF d;
    HWY_UNROLL(8)
    for (int a = 0; a < kAll; ++a) axis[a] = hn::Zero(d);
    const float* at = m.modes + v * m.count * kAll * kBendLanes + lane;
    for (std::size_t j = 0; j < m.count; ++j, at += kAll * kBendLanes) {
      const VF share = hn::Set(d, q[j]);
      HWY_UNROLL(8)
      for (int a = 0; a < kAxes; ++a)
        axis[a] = hn::MulAdd(share, hn::LoadU(d, at + a * kBendLanes), axis[a]);
      if constexpr (kSpreads > 0) {
        const VF size = hn::Abs(share);
        HWY_UNROLL(2)
        for (int a = kAxes; a < kAll; ++a)
          axis[a] = hn::MulAdd(size, hn::LoadU(d, at + a * kBendLanes), axis[a]);
      }
    }
  }
  HWY_INLINE VF length() const { return length_of(axis); }
};

// Calls f(vector, lane) for every register of the listed vectors.
template <class F>
HWY_INLINE void each_register(const std::uint32_t* vectors, std::size_t n, const F& f) {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t lane = 0; lane < kBendLanes; lane += hn::Lanes(DF()))
      f(vectors != nullptr ? vectors[k] : k, lane);
}

// Calls f(v, first, end) for the contacts first..end-1 of each vector v.
template <class F>
HWY_INLINE void each_vector(const BentContacts& c, const F& f) {
  for (std::size_t first = 0, end; first < c.count; first = end) {
    const std::size_t v = c.row[first] / kBendLanes;
    for (end = first; end < c.count && c.row[end] / kBendLanes == v;) ++end;
    f(v, first, end);
  }
}

// The rigid parts of the rows of one vector's contacts; their directions in the axes of the modes
// go to the lanes of their rows, so that modes are read as they lie.
HWY_INLINE void rigid_rows(const BentContacts& c, std::size_t first, std::size_t end,
                           const float turn[9], std::size_t stride, float* out,
                           float (&local)[3][kBendLanes]) {
  for (float(&axis)[kBendLanes] : local)
    for (float& value : axis) value = 0;
  for (std::size_t i = first; i < end; ++i) {
    float own[3];
    rigid_row(c, i, turn, out + i * stride, own);
    for (int k = 0; k < 3; ++k) local[k][c.row[i] % kBendLanes] = own[k];
  }
}
// The modal parts of these rows: the products of each lane's `by` with its modes, which have kAxes
// axes; zeros behind them.
template <int kAxes>
HWY_INLINE void modal_rows(const BentContacts& c, const ModesView& modes, std::size_t v,
                           std::size_t first, std::size_t end, const float (&by)[kAxes][kBendLanes],
                           std::size_t stride, float* out) {
  const DF d;
  HWY_ALIGN float shares[kBendLanes];
  const float* at = modes.modes + v * modes.count * kAxes * kBendLanes;
  for (std::size_t j = 0; j < modes.count; ++j, at += kAxes * kBendLanes) {
    for (std::size_t lane = 0; lane < kBendLanes; lane += hn::Lanes(d)) {
      VF share = hn::Zero(d);
      HWY_UNROLL(6)
      for (int a = 0; a < kAxes; ++a)
        share =
            hn::MulAdd(hn::Load(d, by[a] + lane), hn::LoadU(d, at + a * kBendLanes + lane), share);
      hn::Store(share, d, shares + lane);
    }
    for (std::size_t i = first; i < end; ++i)
      out[i * stride + 6 + j] = shares[c.row[i] % kBendLanes];
  }
  for (std::size_t i = first; i < end; ++i)
    for (std::size_t k = 6 + modes.count; k < stride; ++k) out[i * stride + k] = 0;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
