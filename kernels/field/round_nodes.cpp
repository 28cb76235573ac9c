// SPDX-License-Identifier: Apache-2.0
// round_nodes.cpp - the SIMD twin of round_nodes_ref.cpp.
#include "kernels/field/round_nodes.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/round_nodes.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void RoundNodes(const float* metres, double voxel, double quantum, std::size_t count,
                std::int16_t* out) {
  std::size_t i = 0;
#if HWY_HAVE_FLOAT64
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const hn::Rebind<std::int16_t, decltype(d)> dh;
  // Divisions would take half of the time. A product is off by less than 2e-11 quanta; it rounds as
  // the quotient does, unless it is that near to a tie.
  const double product = 1 / (voxel * quantum);
  if (!std::isfinite(product)) return round_nodes_ref(metres, voxel, quantum, count, out);
  const auto factor = hn::Set(d, product), tie = hn::Set(d, 0.5 - 1e-9);
  const auto least = hn::Set(d, -32767.0), most = hn::Set(d, 32767.0);
  const auto whole = hn::Set(d, 0x1.8p52);
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const auto q = hn::Mul(hn::PromoteTo(d, hn::LoadU(df, metres + i)), factor);
    const auto inside = hn::Min(hn::Max(q, least), most);
    const auto rounded = hn::Sub(hn::Add(inside, whole), whole);
    if (HWY_LIKELY(hn::AllTrue(d, hn::Lt(hn::Abs(hn::Sub(inside, rounded)), tie))))
      hn::StoreU(hn::DemoteTo(dh, hn::DemoteTo(di, rounded)), dh, out + i);
    else
      round_nodes_ref(metres + i, voxel, quantum, hn::Lanes(d), out + i);
  }
#endif
  round_nodes_ref(metres + i, voxel, quantum, count - i, out + i);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(RoundNodes);

void round_nodes(const float* metres, double voxel, double quantum, std::size_t count,
                 std::int16_t* out) {
  HWY_DYNAMIC_DISPATCH(RoundNodes)(metres, voxel, quantum, count, out);
}

}  // namespace h6::kernels
#endif
