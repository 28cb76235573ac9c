// SPDX-License-Identifier: Apache-2.0
// gauss_weights.cpp - the SIMD twin of gauss_weights_ref.cpp: lanes over j, a few rows i a pass.
//
// A hat is summed as max(0, epsilon^2 - |dV|^2): the scale 1/epsilon^2 is the same for all pairs
// and rides on s_j. Sums run in blocks of j, so that rounding grows with the number of blocks and
// not of contacts. Contacts come in the order of the shell, so neighbours often lie on one wall:
// tiles of 32 have a box around their normals, and a tile whose box is out of the hat's reach is
// left out.
//
// Which rows share a pass changes no bit: lanes never mix rows, and whatever is left out would have
// added exactly 0.
#include "kernels/weights/gauss_weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_weights.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
// After highway.h.
#include "hwy/contrib/math/math-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

constexpr std::size_t kTile = 32;  // contacts with one box; a multiple of every vector length
constexpr std::size_t kBlock = 8 * kTile;  // contacts summed before they join the total
constexpr std::size_t kMaxTiles = 1024;    // 32,768 contacts; those past them have no box
constexpr std::size_t kRows = 4;           // rows a pass: loads and s_j are shared between them

struct Scales {
  float normal2, torque2;  // epsilon^2
  float unit_n, unit_t;    // what turns a sum into phi: over N and (Hat::sum) over T
  bool geodesic;
};

HWY_INLINE Scales scales_of(Hat kind, const GaussWidths& widths) {
  const float n = HWY_MAX(widths.normal, kMinWidth), t = HWY_MAX(widths.torque, kMinWidth);
  Scales s{n * n, t * t, 1.0f / (n * n), 1.0f / (t * t), widths.geodesic};
  if (kind == Hat::product) s.unit_n *= s.unit_t;
  return s;
}

// epsilon^2 - |V_j - V_i|^2, or less the angle squared; not yet cut at 0.
HWY_INLINE VF gap_to_edge(bool geodesic, VF epsilon2, VF x, VF y, VF z, const float* vx,
                          const float* vy, const float* vz, std::size_t i) {
  const DF d;
  const VF dx = hn::Sub(x, hn::Set(d, vx[i]));
  const VF dy = hn::Sub(y, hn::Set(d, vy[i]));
  const VF dz = hn::Sub(z, hn::Set(d, vz[i]));
  if (geodesic) {
    const VF gap2 = hn::MulAdd(dz, dz, hn::MulAdd(dy, dy, hn::Mul(dx, dx)));
    const VF half = hn::Mul(hn::Sqrt(gap2), hn::Set(d, 0.5f));
    const VF asin = hn::Asin(d, hn::Min(half, hn::Set(d, 1.0f)));
    return hn::NegMulAdd(hn::Mul(asin, asin), hn::Set(d, 4.0f), epsilon2);
  }
  return hn::NegMulAdd(dz, dz, hn::NegMulAdd(dy, dy, hn::NegMulAdd(dx, dx, epsilon2)));
}

// Adds the contacts from j on (`live` of them, up to a vector) to the sums of kCount rows from i
// on.
template <Hat kHat, std::size_t kCount>
HWY_INLINE void add_contacts(const DirectionsView& c, const Scales& scale, std::size_t i,
                             std::size_t j, std::size_t live, VF* sum) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF x = load_n(d, c.nx + j, live), y = load_n(d, c.ny + j, live);
  const VF z = load_n(d, c.nz + j, live);
  const VF normal2 = hn::Set(d, scale.normal2);
  VF over_normals[kCount];
  VF highest = zero;
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    over_normals[r] =
        hn::Max(gap_to_edge(scale.geodesic, normal2, x, y, z, c.nx, c.ny, c.nz, i + r), zero);
    highest = hn::Max(highest, over_normals[r]);
  }
  const bool apart = hn::AllTrue(d, hn::Eq(highest, zero));
  if (apart && kHat != Hat::sum) return;

  // s_j, and 0 past the end.
  VF share = hn::IfThenElseZero(hn::FirstN(d, live), hn::Set(d, scale.unit_n));
  VF share_t = hn::IfThenElseZero(hn::FirstN(d, live), hn::Set(d, scale.unit_t));
  for (const float* factor : {c.facing, c.depth}) {
    if (factor == nullptr) continue;
    const VF f = load_n(d, factor + j, live);
    share = hn::Mul(share, f);
    if (kHat == Hat::sum) share_t = hn::Mul(share_t, f);
  }
  if (kHat == Hat::normal) {
    HWY_UNROLL(8)
    for (std::size_t r = 0; r < kCount; ++r) sum[r] = hn::MulAdd(share, over_normals[r], sum[r]);
    return;
  }
  const VF tx = load_n(d, c.tx + j, live), ty = load_n(d, c.ty + j, live);
  const VF tz = load_n(d, c.tz + j, live);
  const VF torque2 = hn::Set(d, scale.torque2);
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    const VF over_torques =
        hn::Max(gap_to_edge(scale.geodesic, torque2, tx, ty, tz, c.tx, c.ty, c.tz, i + r), zero);
    if (kHat == Hat::product) {
      sum[r] = hn::MulAdd(share, hn::Mul(over_normals[r], over_torques), sum[r]);
    } else {
      sum[r] = hn::MulAdd(share, over_normals[r], hn::MulAdd(share_t, over_torques, sum[r]));
    }
  }
}

// Boxes around the normals of each tile of contacts.
struct Boxes {
  HWY_ALIGN float low[3][kMaxTiles], high[3][kMaxTiles];
  std::size_t count;  // tiles with a box; entries past it hold nothing of use
};

HWY_INLINE void bound_tiles(const DirectionsView& c, Boxes& boxes) {
  const DF d;
  const std::size_t width = hn::Lanes(d);
  boxes.count = HWY_MIN((c.count + kTile - 1) / kTile, kMaxTiles);
  const float* const axes[3] = {c.nx, c.ny, c.nz};
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t tile = 0; tile < boxes.count; ++tile) {
      const float* v = axes[axis] + tile * kTile;
      const std::size_t live = HWY_MIN(kTile, c.count - tile * kTile);
      VF low = hn::Set(d, v[0]), high = low;
      for (std::size_t j = 0; j < live; j += width) {
        // Lanes past the end repeat the first contact.
        const auto real = hn::FirstN(d, live - j);
        const VF x = hn::IfThenElse(real, load_n(d, v + j, live - j), hn::Set(d, v[0]));
        low = hn::Min(low, x);
        high = hn::Max(high, x);
      }
      boxes.low[axis][tile] = hn::GetLane(hn::MinOfLanes(d, low));
      boxes.high[axis][tile] = hn::GetLane(hn::MaxOfLanes(d, high));
    }
  }
}

// Squared distance of every tile's box from the box of rows i..i+count-1.
HWY_INLINE void distance_to_tiles(const DirectionsView& c, const Boxes& boxes, std::size_t i,
                                  std::size_t count, float* distance2) {
  const DF d;
  const float* const axes[3] = {c.nx, c.ny, c.nz};
  float low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = high[axis] = axes[axis][i];
    for (std::size_t r = 1; r < count; ++r) {
      low[axis] = HWY_MIN(low[axis], axes[axis][i + r]);
      high[axis] = HWY_MAX(high[axis], axes[axis][i + r]);
    }
  }
  for (std::size_t tile = 0; tile < boxes.count; tile += hn::Lanes(d)) {
    VF sum = hn::Zero(d);
    for (int axis = 0; axis < 3; ++axis) {
      const VF above = hn::Sub(hn::Load(d, boxes.low[axis] + tile), hn::Set(d, high[axis]));
      const VF below = hn::Sub(hn::Set(d, low[axis]), hn::Load(d, boxes.high[axis] + tile));
      const VF gap = hn::Max(hn::Max(above, below), hn::Zero(d));
      sum = hn::MulAdd(gap, gap, sum);
    }
    hn::Store(sum, d, distance2 + tile);
  }
}

template <Hat kHat, std::size_t kCount>
HWY_INLINE void weigh_rows(const DirectionsView& c, const Scales& scale, const Boxes& boxes,
                           std::size_t i, float* weight) {
  const DF d;
  const std::size_t width = hn::Lanes(d);
  HWY_ALIGN float distance2[kMaxTiles];
  if (kHat != Hat::sum) distance_to_tiles(c, boxes, i, kCount, distance2);
  // Beyond the reach by more than rounding: the hat of every pair is exactly 0.
  const float reach2 = scale.normal2 * 1.0001f;
  VF total[kCount];
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) total[r] = hn::Zero(d);
  for (std::size_t block = 0; block < c.count; block += kBlock) {
    const std::size_t end = HWY_MIN(c.count, block + kBlock);
    VF sum[kCount];
    HWY_UNROLL(8)
    for (std::size_t r = 0; r < kCount; ++r) sum[r] = hn::Zero(d);
    for (std::size_t first = block; first < end; first += kTile) {
      const std::size_t tile = first / kTile;
      if (kHat != Hat::sum && tile < boxes.count && distance2[tile] > reach2) continue;
      const std::size_t tile_end = HWY_MIN(end, first + kTile);
      std::size_t j = first;
      for (; j + width <= tile_end; j += width)
        add_contacts<kHat, kCount>(c, scale, i, j, width, sum);
      if (j < tile_end) add_contacts<kHat, kCount>(c, scale, i, j, tile_end - j, sum);
    }
    HWY_UNROLL(8)
    for (std::size_t r = 0; r < kCount; ++r) total[r] = hn::Add(total[r], sum[r]);
  }
  HWY_UNROLL(8)
  for (std::size_t r = 0; r < kCount; ++r) {
    const float phi = hn::GetLane(hn::SumOfLanes(d, total[r]));
    const float facing = c.facing != nullptr ? c.facing[i + r] : 1.0f;
    const float share = facing * (c.depth != nullptr ? c.depth[i + r] : 1.0f);
    const float self = kHat == Hat::sum ? 2.0f : 1.0f;
    // phi >= share unless both are too small for a float.
    weight[i + r] = share > 0 && phi > 0 ? facing * share * self / phi : 0.0f;
  }
}

template <Hat kHat>
HWY_INLINE void weigh(const DirectionsView& c, const GaussWidths& widths, std::size_t begin,
                      std::size_t end, float* weight) {
  const Scales scale = scales_of(kHat, widths);
  Boxes boxes;
  boxes.count = 0;
  if (kHat != Hat::sum) bound_tiles(c, boxes);
  std::size_t i = begin;
  for (; i + kRows <= end; i += kRows) weigh_rows<kHat, kRows>(c, scale, boxes, i, weight);
  for (; i < end; ++i) weigh_rows<kHat, 1>(c, scale, boxes, i, weight);
}

void gauss_weights_simd(const DirectionsView& c, Hat kind, const GaussWidths& widths,
                        std::size_t begin, std::size_t end, float* weight) {
  switch (kind) {
    case Hat::normal:
      return weigh<Hat::normal>(c, widths, begin, end, weight);
    case Hat::sum:
      return weigh<Hat::sum>(c, widths, begin, end, weight);
    case Hat::product:
      return weigh<Hat::product>(c, widths, begin, end, weight);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(gauss_weights_simd);

void gauss_weights(const DirectionsView& c, Hat kind, const GaussWidths& widths, std::size_t begin,
                   std::size_t end, float* weight) {
  HWY_DYNAMIC_DISPATCH(gauss_weights_simd)(c, kind, widths, begin, end, weight);
}

}  // namespace h6::kernels
#endif
