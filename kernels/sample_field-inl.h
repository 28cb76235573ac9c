// sample_field-inl.h - one vector of field samples; shared by sample_field and cull_spheres.
//
// Included once for each SIMD target. Two neighbours along x are 4 adjacent bytes, in a brick and
// in a far cell alike: 4 gathers of 32 bits fetch the 8 corners.
//
//          y1z1 --- pair 3       pair = low half: corner at x, high half: corner at x + 1
//         /    /
//     y1z0    y0z1
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "kernels/views.h"

// Per-target include guard.
#if defined(H6_KERNELS_SAMPLE_FIELD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_SAMPLE_FIELD_INL_H_
#undef H6_KERNELS_SAMPLE_FIELD_INL_H_
#else
#define H6_KERNELS_SAMPLE_FIELD_INL_H_
#endif

#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

// Two int16 at each byte offset.
HWY_INLINE VI gather_pairs(const std::int16_t* pool, VI offset) {
#if HWY_TARGET == HWY_SCALAR
  // Highway's one-lane gather reads through an int32 pointer, which pairs are not aligned for.
  std::int32_t pair;
  std::memcpy(&pair, reinterpret_cast<const char*>(pool) + hn::GetLane(offset), sizeof pair);
  return hn::Set(DI(), pair);
#else
  return hn::GatherOffset(DI(), reinterpret_cast<const std::int32_t*>(pool), offset);
#endif
}

HWY_INLINE VF low_half(VI pair) {
  return hn::ConvertTo(DF(), hn::ShiftRight<16>(hn::ShiftLeft<16>(pair)));
}
HWY_INLINE VF high_half(VI pair) { return hn::ConvertTo(DF(), hn::ShiftRight<16>(pair)); }
HWY_INLINE VF lerp(VF a, VF b, VF t) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// Up to a full vector of points of a column set: rows first..first+live-1, or those listed. Lanes
// that are not live stand at the origin or repeat row 0.
struct Lanes {
  const std::uint32_t* rows;
  std::size_t first, live;
};

HWY_INLINE VI load_rows(const Lanes& lanes) {
  if (lanes.rows == nullptr) return hn::Zero(DI());
  return load_n(DI(), reinterpret_cast<const std::int32_t*>(lanes.rows) + lanes.first, lanes.live);
}

HWY_INLINE VF load_column(const float* column, const Lanes& lanes, VI row) {
  if (lanes.rows != nullptr) return hn::GatherIndex(DF(), column, row);
  return load_n(DF(), column + lanes.first, lanes.live);
}

// Body coordinates to field coordinates.
HWY_INLINE VF affine_row(const float* m, VF x, VF y, VF z) {
  const DF d;
  const VF t = hn::MulAdd(hn::Set(d, m[2]), z, hn::Set(d, m[3]));
  return hn::MulAdd(hn::Set(d, m[0]), x, hn::MulAdd(hn::Set(d, m[1]), y, t));
}

// One axis of a point inside the grid: which brick, which unit cell in it, where in that cell.
struct Axis {
  VI brick, cell;
  VF fraction;
};

HWY_INLINE Axis split_axis(VF q, std::int32_t bricks) {
  const DI di;
  // The last unit cell ends at the last node: a point there has fraction 1, not a cell of its own.
  const VI unit = hn::Min(hn::ConvertTo(di, q), hn::Set(di, 8 * bricks - 2));
  return {hn::ShiftRight<3>(unit), hn::And(unit, hn::Set(di, 7)),
          hn::Sub(q, hn::ConvertTo(DF(), unit))};
}

// Where a unit cell is: its brick's entry in the table, its first node in that brick.
struct Cell {
  VI slot, node;
};

HWY_INLINE Cell cell_of(const FieldView& field, const Axis& x, const Axis& y, const Axis& z) {
  const DI di;
  const VI plane = hn::Add(hn::Mul(z.brick, hn::Set(di, field.size[1])), y.brick);
  return {hn::Add(hn::Mul(plane, hn::Set(di, field.size[0])), x.brick),
          hn::Add(x.cell, hn::Add(hn::Mul(y.cell, hn::Set(di, 9)), hn::Mul(z.cell, hn::Set(di, 81))))};
}

// Position of a point in the 8-voxel cell, 0..1.
HWY_INLINE VF far_fraction(const Axis& a) {
  const DF d;
  return hn::Mul(hn::Add(a.fraction, hn::ConvertTo(d, a.cell)), hn::Set(d, 0.125f));
}

// The bound of far cells from the values at their corners, as pairs along x [quanta], and the
// fractions: views.h. The sign is that of the interpolated value.
HWY_INLINE VF far_bound(const VF low[4], const VF step[4], const Axis& x, const Axis& y,
                        const Axis& z, VF value, float band) {
  const DF d;
  VF row[4];
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) {
    const VF high = hn::Add(low[k], step[k]);
    row[k] = lerp(hn::Mul(low[k], low[k]), hn::Mul(high, high), x.fraction);
  }
  const VF whole =
      hn::Mul(lerp(lerp(row[0], row[1], y.fraction), lerp(row[2], row[3], y.fraction), z.fraction),
              hn::Set(d, kFarQuantum * kFarQuantum));
  const VF one = hn::Set(d, 1.0f);
  const VF sag = hn::MulAdd(x.fraction, hn::Sub(one, x.fraction),
                            hn::MulAdd(y.fraction, hn::Sub(one, y.fraction),
                                       hn::Mul(z.fraction, hn::Sub(one, z.fraction))));
  const VF square = hn::Max(hn::NegMulAdd(sag, hn::Set(d, 64.0f), whole),
                            hn::Min(whole, hn::Set(d, band * band)));
  return hn::CopySign(hn::Sqrt(square), value);
}

// Value and gradient at points inside the grid.
template <bool kGradient>
HWY_INLINE void sample_inside(const FieldView& field, VF qx, VF qy, VF qz, VF& value, VF& gx,
                              VF& gy, VF& gz) {
  const DF d;
  const DI di;
  Axis x = split_axis(qx, field.size[0]);
  Axis y = split_axis(qy, field.size[1]);
  Axis z = split_axis(qz, field.size[2]);
  const Cell cell = cell_of(field, x, y, z);
  const VI entry = hn::GatherIndex(di, field.table, cell.slot);

  const auto far = hn::Lt(entry, hn::Zero(di));
  const bool any_far = !hn::AllFalse(di, far);
  VI pair[4];
  VF quantum = hn::Set(d, kNearQuantum);
  VF slope = quantum;
  if (!hn::AllTrue(di, far)) {
    const VI offset = hn::IfThenZeroElse(
        far, hn::Add(hn::Mul(entry, hn::Set(di, 2 * kBrickStride)), hn::ShiftLeft<1>(cell.node)));
    pair[0] = gather_pairs(field.bricks, offset);
    pair[1] = gather_pairs(field.bricks + 9, offset);
    pair[2] = gather_pairs(field.bricks + 81, offset);
    pair[3] = gather_pairs(field.bricks + 90, offset);
  } else {
    pair[0] = pair[1] = pair[2] = pair[3] = hn::Zero(di);
  }
  if (any_far) {
    const VI row = hn::Sub(hn::Set(di, -1), entry);
    const VI offset = hn::IfThenElseZero(far, hn::ShiftLeft<4>(row));
    HWY_UNROLL(4)
    for (int k = 0; k < 4; ++k) {
      pair[k] = hn::IfThenElse(far, gather_pairs(field.far + 2 * k, offset), pair[k]);
    }
    const auto far_f = hn::RebindMask(d, far);
    x.fraction = hn::IfThenElse(far_f, far_fraction(x), x.fraction);
    y.fraction = hn::IfThenElse(far_f, far_fraction(y), y.fraction);
    z.fraction = hn::IfThenElse(far_f, far_fraction(z), z.fraction);
    quantum = hn::IfThenElse(far_f, hn::Set(d, kFarQuantum), quantum);
    slope = hn::IfThenElse(far_f, hn::Set(d, kFarQuantum / 8), slope);
  }

  // c[z][y] along x, then along y, then along z.
  const VF c00 = low_half(pair[0]), c01 = low_half(pair[1]);
  const VF c10 = low_half(pair[2]), c11 = low_half(pair[3]);
  const VF e00 = hn::Sub(high_half(pair[0]), c00), e01 = hn::Sub(high_half(pair[1]), c01);
  const VF e10 = hn::Sub(high_half(pair[2]), c10), e11 = hn::Sub(high_half(pair[3]), c11);
  const VF a00 = hn::MulAdd(x.fraction, e00, c00), a01 = hn::MulAdd(x.fraction, e01, c01);
  const VF a10 = hn::MulAdd(x.fraction, e10, c10), a11 = hn::MulAdd(x.fraction, e11, c11);
  const VF h0 = hn::Sub(a01, a00), h1 = hn::Sub(a11, a10);
  const VF b0 = hn::MulAdd(y.fraction, h0, a00), b1 = hn::MulAdd(y.fraction, h1, a10);
  const VF k = hn::Sub(b1, b0);
  value = hn::Mul(hn::MulAdd(z.fraction, k, b0), quantum);
  if (any_far) {
    const VF low[4] = {c00, c01, c10, c11}, step[4] = {e00, e01, e10, e11};
    value = hn::IfThenElse(hn::RebindMask(d, far), far_bound(low, step, x, y, z, value, field.band),
                           value);
  }
  if (kGradient) {
    gx = hn::Mul(lerp(lerp(e00, e01, y.fraction), lerp(e10, e11, y.fraction), z.fraction), slope);
    gy = hn::Mul(lerp(h0, h1, z.fraction), slope);
    gz = hn::Mul(k, slope);
  }
}

// One axis of the gradient outside the grid, where distance = sqrt(off^2 + value^2): off/distance
// along axes that were clamped, value/distance times the slope on the grid along the others.
HWY_INLINE VF outside_slope(VF off, VF slope, VF value, VF inverse) {
  const auto clamped = hn::Ne(off, hn::Zero(DF()));
  return hn::Mul(hn::IfThenElse(clamped, off, hn::Mul(value, slope)), inverse);
}

// Distance and gradient of any points, as sample_field.h says. x, y, z in field coordinates.
template <bool kGradient>
HWY_INLINE void sample_points(const FieldView& field, VF x, VF y, VF z, VF& distance, VF& gx,
                              VF& gy, VF& gz) {
  const DF d;
  const VF zero = hn::Zero(d);
  // 0 * v is 0 for finite v alone.
  const auto finite =
      hn::Eq(hn::Add(hn::Mul(x, zero), hn::Add(hn::Mul(y, zero), hn::Mul(z, zero))), zero);
  x = hn::IfThenElseZero(finite, x);
  y = hn::IfThenElseZero(finite, y);
  z = hn::IfThenElseZero(finite, z);
  const auto last = [&](int axis) HWY_ATTR {
    return hn::Set(d, static_cast<float>(8 * field.size[axis] - 1));
  };
  const VF qx = hn::Min(hn::Max(x, zero), last(0));
  const VF qy = hn::Min(hn::Max(y, zero), last(1));
  const VF qz = hn::Min(hn::Max(z, zero), last(2));
  sample_inside<kGradient>(field, qx, qy, qz, distance, gx, gy, gz);

  const VF ox = hn::Sub(x, qx), oy = hn::Sub(y, qy), oz = hn::Sub(z, qz);
  const VF off2 = hn::MulAdd(ox, ox, hn::MulAdd(oy, oy, hn::Mul(oz, oz)));
  const auto outside = hn::Gt(off2, zero);
  if (HWY_UNLIKELY(!hn::AllFalse(d, outside))) {
    const VF value = hn::Max(distance, zero);
    const VF away = hn::Sqrt(hn::MulAdd(value, value, off2));
    distance = hn::IfThenElse(outside, away, distance);
    if (kGradient) {
      const VF inverse = hn::Div(hn::Set(d, 1.0f), away);
      gx = hn::IfThenElse(outside, outside_slope(ox, gx, value, inverse), gx);
      gy = hn::IfThenElse(outside, outside_slope(oy, gy, value, inverse), gy);
      gz = hn::IfThenElse(outside, outside_slope(oz, gz, value, inverse), gz);
    }
  }
  if (HWY_UNLIKELY(!hn::AllTrue(d, finite))) {
    const VF infinity = hn::Set(d, __builtin_huge_valf());
    distance = hn::IfThenElse(finite, distance, infinity);
    if (kGradient) {
      gx = hn::IfThenElseZero(finite, gx);
      gy = hn::IfThenElseZero(finite, gy);
      gz = hn::IfThenElseZero(finite, gz);
    }
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
