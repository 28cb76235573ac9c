// SPDX-License-Identifier: Apache-2.0
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

// ---- gathers, done lane by lane, four to a register. The gather instruction is microcode on many
// processors and takes longer.

HWY_INLINE std::int32_t load_32(const void* from) {
  std::int32_t value;  // pairs are aligned to 16 bits
  std::memcpy(&value, from, sizeof value);
  return value;
}

#if HWY_TARGET != HWY_SCALAR
using D4 = hn::CappedTag<std::int32_t, 4>;
using V4 = hn::Vec<D4>;
constexpr std::size_t kFours = hn::MaxLanes(DF()) / 4;

// hn::Set would copy the lane to all four, which is one more instruction.
HWY_INLINE hn::Vec<hn::CappedTag<std::int32_t, 1>> one_of(const void* a) {
  const std::int32_t value = load_32(a);
  return hn::Load(hn::CappedTag<std::int32_t, 1>(), &value);
}
HWY_INLINE V4 four_of(const void* a, const void* b, const void* c, const void* e) {
  const hn::Half<D4> half;
  return hn::Combine(D4(), hn::Combine(half, one_of(e), one_of(c)),
                     hn::Combine(half, one_of(b), one_of(a)));
}

template <class D>
HWY_INLINE hn::Vec<D> join_fours(D d, const V4* four) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return four[0];
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, join_fours(half, four + hn::MaxLanes(half) / 4), join_fours(half, four));
  }
}
#endif

// The int32 at each index of a vector.
HWY_INLINE VI gather_entries(const std::int32_t* table, const std::int32_t* at) {
  const DI di;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(di, table[at[0]]);
#else
  V4 four[kFours];
  HWY_UNROLL(4)
  for (std::size_t k = 0; k < kFours; ++k)
    four[k] = four_of(table + at[4 * k], table + at[4 * k + 1], table + at[4 * k + 2],
                      table + at[4 * k + 3]);
  return join_fours(di, four);
#endif
}

// The two int16 at each byte offset of `pool` plus constants.
template <int kPairs>
HWY_INLINE void gather_pairs(const std::int16_t* pool, const std::int32_t* at,
                             const int (&behind)[kPairs], VI (&pair)[kPairs]) {
  const DI di;
  const char* const bytes = reinterpret_cast<const char*>(pool);
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < kPairs; ++k) pair[k] = hn::Set(di, load_32(bytes + at[0] + behind[k]));
#else
  V4 four[kPairs][kFours];
  HWY_UNROLL(4)
  for (std::size_t i = 0; i < kFours; ++i) {
    const char *const a = bytes + at[4 * i], *const b = bytes + at[4 * i + 1];
    const char *const c = bytes + at[4 * i + 2], *const e = bytes + at[4 * i + 3];
    HWY_UNROLL(4)
    for (int k = 0; k < kPairs; ++k)
      four[k][i] = four_of(a + behind[k], b + behind[k], c + behind[k], e + behind[k]);
  }
  for (int k = 0; k < kPairs; ++k) pair[k] = join_fours(di, four[k]);
#endif
}

// The int32 at each byte offset of `pool`.
HWY_INLINE VI gather_at(const void* pool, const std::int32_t* at) {
  const DI di;
  const char* const bytes = static_cast<const char*>(pool);
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(di, load_32(bytes + at[0]));
#else
  V4 four[kFours];
  HWY_UNROLL(4)
  for (std::size_t k = 0; k < kFours; ++k)
    four[k] = four_of(bytes + at[4 * k], bytes + at[4 * k + 1], bytes + at[4 * k + 2],
                      bytes + at[4 * k + 3]);
  return join_fours(di, four);
#endif
}

// Bytes from a cell's first corner to the next row and to the next plane, in a brick and in a far
// cell.
constexpr int kNearCorners[4] = {0, 2 * 9, 2 * 81, 2 * 90};
constexpr int kFarCorners[4] = {0, 4, 8, 12};

HWY_INLINE VF low_half(VI pair) {
  return hn::ConvertTo(DF(), hn::ShiftRight<16>(hn::ShiftLeft<16>(pair)));
}
HWY_INLINE VF high_half(VI pair) { return hn::ConvertTo(DF(), hn::ShiftRight<16>(pair)); }
HWY_INLINE VF lerp(VF a, VF b, VF t) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// Up to a vector of points: rows first..first+live-1 of the columns, or the listed rows. Lanes past
// `live` are at the origin or repeat row 0.
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

// One axis of a point inside the grid: its brick, its unit cell in the brick, its fraction.
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

// A unit cell: the table entry of its brick, and its first node in that brick.
struct Cell {
  VI slot, node;
};

HWY_INLINE Cell cell_of(const FieldView& field, const Axis& x, const Axis& y, const Axis& z) {
  const DI di;
  const VI plane = hn::Add(hn::Mul(z.brick, hn::Set(di, field.size[1])), y.brick);
  return {
      hn::Add(hn::Mul(plane, hn::Set(di, field.size[0])), x.brick),
      hn::Add(x.cell, hn::Add(hn::Mul(y.cell, hn::Set(di, 9)), hn::Mul(z.cell, hn::Set(di, 81))))};
}

// Position of a point in the 8-voxel cell, 0..1.
HWY_INLINE VF far_fraction(const Axis& a) {
  const DF d;
  return hn::Mul(hn::Add(a.fraction, hn::ConvertTo(d, a.cell)), hn::Set(d, 0.125f));
}

// Squares at the corners of far cells [quanta^2], as pairs along x, interpolated.
struct Squares {
  VF low[4], step[4];
};
HWY_INLINE VF interpolate_squares(const Squares& s, VF x, VF y, VF z) {
  const VF a = lerp(hn::MulAdd(s.step[0], x, s.low[0]), hn::MulAdd(s.step[1], x, s.low[1]), y);
  const VF b = lerp(hn::MulAdd(s.step[2], x, s.low[2]), hn::MulAdd(s.step[3], x, s.low[3]), y);
  return hn::Mul(lerp(a, b, z), hn::Set(DF(), kFarQuantum * kFarQuantum));
}

// J of views.h.
HWY_INLINE VF far_bound_at(VF whole, VF x, VF y, VF z, VF floor) {
  const DF d;
  const VF one = hn::Set(d, 1.0f);
  const VF sag =
      hn::MulAdd(x, hn::Sub(one, x), hn::MulAdd(y, hn::Sub(one, y), hn::Mul(z, hn::Sub(one, z))));
  return hn::Sqrt(
      hn::Max(hn::NegMulAdd(sag, hn::Set(d, 64.0f), whole), hn::Min(whole, hn::Mul(floor, floor))));
}

// The band, and the way from a place in a cell to its end [voxel].
HWY_INLINE VF band_and_end(VF x, VF y, VF z, float band) {
  const DF d;
  const VF one = hn::Set(d, 1.0f);
  const VF low = hn::Min(x, hn::Min(y, z)), high = hn::Max(x, hn::Max(y, z));
  return hn::MulAdd(hn::Min(low, hn::Sub(one, high)), hn::Set(d, 8.0f), hn::Set(d, band));
}

// The way from a place along a direction n to the end of its cell on one axis: over / under, in
// lengths of n.
struct WayOut {
  VF over, under;
};
HWY_INLINE WayOut way_out(VF fraction, VF n) {
  const DF d;
  const auto up = hn::Gt(n, hn::Zero(d));
  return {hn::IfThenElse(up, hn::Sub(hn::Set(d, 1.0f), fraction), fraction), hn::Abs(n)};
}
HWY_INLINE WayOut shorter(const WayOut& a, const WayOut& b) {
  const auto less = hn::Lt(hn::Mul(a.over, b.under), hn::Mul(b.over, a.under));
  return {hn::IfThenElse(less, a.over, b.over), hn::IfThenElse(less, a.under, b.under)};
}

// A gradient of squares [quanta^2 a cell] below this counts as 0.
constexpr float kLeastSlope = 1e-6f;

// J where the gradient of the squares leaves the cell, less the way there [voxel].
HWY_INLINE VF bound_from_farther(const Squares& s, VF x, VF y, VF z, float band) {
  const DF d;
  VF row[4];
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) row[k] = hn::MulAdd(s.step[k], x, s.low[k]);
  VF nx = lerp(lerp(s.step[0], s.step[1], y), lerp(s.step[2], s.step[3], y), z);
  VF ny = lerp(hn::Sub(row[1], row[0]), hn::Sub(row[3], row[2]), z);
  VF nz = hn::Sub(lerp(row[2], row[3], y), lerp(row[0], row[1], y));
  const WayOut end = shorter(way_out(z, nz), shorter(way_out(y, ny), way_out(x, nx)));
  const VF way = hn::Div(end.over, hn::Max(end.under, hn::Set(d, kLeastSlope)));  // gradients
  const VF length2 = hn::MulAdd(nx, nx, hn::MulAdd(ny, ny, hn::Mul(nz, nz)));
  x = hn::MulAdd(way, nx, x), y = hn::MulAdd(way, ny, y), z = hn::MulAdd(way, nz, z);
  return hn::NegMulAdd(hn::Mul(way, hn::Set(d, 8.0f)), hn::Sqrt(length2),
                       far_bound_at(interpolate_squares(s, x, y, z), x, y, z, hn::Set(d, band)));
}

// The bound of far cells from the values at their corners, as pairs along x [quanta], and the
// fractions: views.h. The sign is that of the interpolated value.
HWY_INLINE VF far_bound(const VF low[4], const VF step[4], VF x, VF y, VF z, VF value, float band) {
  const DF d;
  Squares s;
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) {
    const VF high = hn::Add(low[k], step[k]);
    s.low[k] = hn::Mul(low[k], low[k]);
    s.step[k] = hn::Sub(hn::Mul(high, high), s.low[k]);
  }
  const VF whole = interpolate_squares(s, x, y, z);
  VF bound = far_bound_at(whole, x, y, z, band_and_end(x, y, z, band));
  const auto close = hn::Lt(whole, hn::Set(d, kAskFarther * kAskFarther));
  if (!hn::AllFalse(d, close))
    bound = hn::IfThenElse(close, hn::Max(bound, bound_from_farther(s, x, y, z, band)), bound);
  return hn::CopySign(bound, value);
}

// Byte offsets of the first corners in the pool of bricks.
HWY_INLINE VI near_offset(VI row, VI node) {
  const DI di;
  return hn::Add(hn::Mul(row, hn::Set(di, 2 * kBrickStride)), hn::ShiftLeft<1>(node));
}

// The place of a point along one axis of a cell that is cut into `factor`.
struct FineAxis {
  VI low;
  VF fraction;
};
HWY_INLINE FineAxis split_cell(VF fraction, VF factor) {
  const DF d;
  const VF scaled = hn::Mul(fraction, factor);
  const VF low =
      hn::Min(hn::ConvertTo(d, hn::ConvertTo(DI(), scaled)), hn::Sub(factor, hn::Set(d, 1.0f)));
  return {hn::ConvertTo(DI(), low), hn::Sub(scaled, low)};
}

// Where the corners of a cell lie in the pool: the byte offset of the first, and the bytes to the
// next row and to the next plane.
struct Place {
  VI first, line, plane;
};

// Finds the lanes of refined bricks whose cell, x fastest of 8 x 8 x 8, is cut. Returns their
// codes, 0 in other lanes.
HWY_INLINE VI codes_of(const FieldView& field, VI row, hn::Mask<DI> refined, VI cell) {
  const DI di;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  const VI code = hn::Add(hn::Mul(row, hn::Set(di, 2 * kCutStride)),
                          hn::Add(hn::Set(di, 2 * kCutHead), hn::ShiftLeft<1>(cell)));
  hn::Store(hn::IfThenElseZero(refined, code), di, at);
  return hn::IfThenElseZero(refined, hn::And(gather_at(field.cuts, at), hn::Set(di, 0xffff)));
}

// The cell of 8 x 8 x 8 whose first node has this number of 9 x 9 x 9.
HWY_INLINE VI cell_at(VI node) {
  const DF d;
  const DI di;
  // node = x + 9 y + 81 z, each below 8: exact in float, and no multiple of a ninth is near.
  const auto over = [&](VI n, float share) HWY_ATTR {
    return hn::ConvertTo(
        di, hn::Mul(hn::Add(hn::ConvertTo(d, n), hn::Set(d, 0.5f)), hn::Set(d, share)));
  };
  // x + 8 y + 64 z = node - y' - 8 z, y' = y + 9 z being the number of whole rows before it.
  return hn::Sub(node, hn::Add(over(node, 1.0f / 9), hn::ShiftLeft<3>(over(node, 1.0f / 81))));
}

// Where a point lies in its cell, along each axis.
struct Fractions {
  VF x, y, z;
};

// Puts the finer samples of cut cells in the place of the brick's: place, fractions and quantum.
// The slope per voxel needs no change, since finer samples have a finer quantum.
HWY_INLINE void take_finer(const FieldView& field, VI row, VI code, Fractions& at_cell,
                           Place& place, VF& quantum) {
  const DF d;
  const DI di;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  const auto cut = hn::Ne(code, hn::Zero(di));
  hn::Store(hn::IfThenElseZero(cut, hn::Mul(row, hn::Set(di, 2 * kCutStride))), di, at);
  const VI unit = hn::Add(gather_at(field.cuts, at), hn::ShiftRight<1>(code));
  const auto quarter = hn::Ne(hn::And(code, hn::Set(di, 1)), hn::Zero(di));
  const VF factor = hn::IfThenElse(hn::RebindMask(d, quarter), hn::Set(d, 4.0f), hn::Set(d, 2.0f));
  const FineAxis fx = split_cell(at_cell.x, factor), fy = split_cell(at_cell.y, factor),
                 fz = split_cell(at_cell.z, factor);
  const VI line = hn::IfThenElse(quarter, hn::Set(di, 2 * 5), hn::Set(di, 2 * 3));
  const VI plane = hn::IfThenElse(quarter, hn::Set(di, 2 * 25), hn::Set(di, 2 * 9));
  const std::ptrdiff_t behind =
      reinterpret_cast<const char*>(field.fine) - reinterpret_cast<const char*>(field.bricks);
  const VI node =
      hn::Add(hn::ShiftLeft<1>(fx.low), hn::Add(hn::Mul(line, fy.low), hn::Mul(plane, fz.low)));
  const VI first = hn::Add(hn::Set(di, static_cast<std::int32_t>(behind)),
                           hn::Add(hn::Mul(unit, hn::Set(di, 2 * kFineUnit)), node));
  place.first = hn::IfThenElse(cut, first, place.first);
  place.line = hn::IfThenElse(cut, line, place.line);
  place.plane = hn::IfThenElse(cut, plane, place.plane);
  const auto cut_f = hn::RebindMask(d, cut);
  at_cell.x = hn::IfThenElse(cut_f, fx.fraction, at_cell.x);
  at_cell.y = hn::IfThenElse(cut_f, fy.fraction, at_cell.y);
  at_cell.z = hn::IfThenElse(cut_f, fz.fraction, at_cell.z);
  quantum = hn::IfThenElse(cut_f,
                           hn::Mul(quantum, hn::IfThenElse(hn::RebindMask(d, quarter),
                                                           hn::Set(d, 0.25f), hn::Set(d, 0.5f))),
                           quantum);
}

// The two int16 at the corners of cells anywhere in the pool.
HWY_INLINE void gather_places(const std::int16_t* pool, const Place& place, VI (&pair)[4]) {
  const DI di;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  const VI behind[4] = {hn::Zero(di), place.line, place.plane, hn::Add(place.line, place.plane)};
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) {
    hn::Store(hn::Add(place.first, behind[k]), di, at);
    pair[k] = gather_at(pool, at);
  }
}

// Interpolates pairs along x, then along y and z, at fractions of the cell.
struct Corners {
  VF low[4], step[4];  // c[z][y] at x, and what is added to it at x + 1
};
HWY_INLINE Corners corners_of(const VI (&pair)[4]) {
  Corners c;
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) {
    c.low[k] = low_half(pair[k]);
    c.step[k] = hn::Sub(high_half(pair[k]), c.low[k]);
  }
  return c;
}
template <bool kGradient>
HWY_INLINE void interpolate(const Corners& c, VF x, VF y, VF z, VF quantum, VF slope, VF& value,
                            VF& gx, VF& gy, VF& gz) {
  const VF a00 = hn::MulAdd(x, c.step[0], c.low[0]), a01 = hn::MulAdd(x, c.step[1], c.low[1]);
  const VF a10 = hn::MulAdd(x, c.step[2], c.low[2]), a11 = hn::MulAdd(x, c.step[3], c.low[3]);
  const VF h0 = hn::Sub(a01, a00), h1 = hn::Sub(a11, a10);
  const VF b0 = hn::MulAdd(y, h0, a00), b1 = hn::MulAdd(y, h1, a10);
  const VF k = hn::Sub(b1, b0);
  value = hn::Mul(hn::MulAdd(z, k, b0), quantum);
  if (kGradient) {
    gx = hn::Mul(lerp(lerp(c.step[0], c.step[1], y), lerp(c.step[2], c.step[3], y), z), slope);
    gy = hn::Mul(lerp(h0, h1, z), slope);
    gz = hn::Mul(k, slope);
  }
}

// Value and gradient at points inside the grid. With kDefer, a few lanes with finer samples among
// others are left out: their bits are set in the result, and their values are not those of the
// field.
template <bool kGradient, bool kDefer>
HWY_INLINE hn::Mask<DI> sample_inside(const FieldView& field, VF qx, VF qy, VF qz, VF& value,
                                      VF& gx, VF& gy, VF& gz) {
  const DF d;
  const DI di;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  Axis x = split_axis(qx, field.size[0]);
  Axis y = split_axis(qy, field.size[1]);
  Axis z = split_axis(qz, field.size[2]);
  const Cell cell = cell_of(field, x, y, z);
  hn::Store(cell.slot, di, at);
  const VI entry = gather_entries(field.table, at);

  const auto far = hn::Lt(entry, hn::Zero(di));
  const bool any_far = !hn::AllFalse(di, far);
  auto left_out = hn::FirstN(di, 0);
  VI pair[4];
  VF quantum = hn::Set(d, kNearQuantum);
  VF slope = quantum;
  if (!hn::AllTrue(di, far)) {
    const VI row = hn::And(entry, hn::Set(di, ~kRefined));
    const VI first = hn::IfThenZeroElse(far, near_offset(row, cell.node));
    const auto refined = hn::Gt(entry, hn::Set(di, kRefined - 1));
    VI code = hn::Zero(di);
    if (!hn::AllFalse(di, refined)) {
      code = codes_of(field, row, refined,
                      hn::Add(x.cell, hn::Add(hn::ShiftLeft<3>(y.cell), hn::ShiftLeft<6>(z.cell))));
      if (kDefer) {
        const auto cut = hn::Ne(code, hn::Zero(di));
        if (2 * hn::CountTrue(di, cut) < hn::Lanes(di)) left_out = cut, code = hn::Zero(di);
      }
    }
    if (HWY_LIKELY(hn::AllTrue(di, hn::Eq(code, hn::Zero(di))))) {
      hn::Store(first, di, at);
      gather_pairs(field.bricks, at, kNearCorners, pair);
    } else {
      Place place{first, hn::Set(di, kNearCorners[1]), hn::Set(di, kNearCorners[2])};
      Fractions at_cell{x.fraction, y.fraction, z.fraction};
      take_finer(field, row, code, at_cell, place, quantum);
      x.fraction = at_cell.x, y.fraction = at_cell.y, z.fraction = at_cell.z;
      gather_places(field.bricks, place, pair);
    }
  } else {
    pair[0] = pair[1] = pair[2] = pair[3] = hn::Zero(di);
  }
  if (any_far) {
    const VI row = hn::Sub(hn::Set(di, -1), entry);
    hn::Store(hn::IfThenElseZero(far, hn::ShiftLeft<4>(row)), di, at);
    VI corner[4];
    gather_pairs(field.far, at, kFarCorners, corner);
    for (int k = 0; k < 4; ++k) pair[k] = hn::IfThenElse(far, corner[k], pair[k]);
    const auto far_f = hn::RebindMask(d, far);
    x.fraction = hn::IfThenElse(far_f, far_fraction(x), x.fraction);
    y.fraction = hn::IfThenElse(far_f, far_fraction(y), y.fraction);
    z.fraction = hn::IfThenElse(far_f, far_fraction(z), z.fraction);
    quantum = hn::IfThenElse(far_f, hn::Set(d, kFarQuantum), quantum);
    slope = hn::IfThenElse(far_f, hn::Set(d, kFarQuantum / 8), slope);
  }
  const Corners c = corners_of(pair);
  interpolate<kGradient>(c, x.fraction, y.fraction, z.fraction, quantum, slope, value, gx, gy, gz);
  if (any_far) {
    const VF bound =
        far_bound(c.low, c.step, x.fraction, y.fraction, z.fraction, value, field.band);
    value = hn::IfThenElse(hn::RebindMask(d, far), bound, value);
  }
  return left_out;
}

// One axis of the gradient outside the grid, where distance = sqrt(off^2 + value^2): off/distance
// along axes that were clamped, value/distance times the slope on the grid along the others.
HWY_INLINE VF outside_slope(VF off, VF slope, VF value, VF inverse) {
  const auto clamped = hn::Ne(off, hn::Zero(DF()));
  return hn::Mul(hn::IfThenElse(clamped, off, hn::Mul(value, slope)), inverse);
}

// Distance and gradient of any points, as sample_field.h says. x, y, z in field coordinates.
// Returns the lanes that sample_inside left out.
template <bool kGradient, bool kDefer = false>
HWY_INLINE hn::Mask<DI> sample_points(const FieldView& field, VF x, VF y, VF z, VF& distance,
                                      VF& gx, VF& gy, VF& gz) {
  const DF d;
  const VF zero = hn::Zero(d);
  // 0 * v is 0 only for finite v.
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
  const auto left_out = sample_inside<kGradient, kDefer>(field, qx, qy, qz, distance, gx, gy, gz);

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
  return left_out;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
