// SPDX-License-Identifier: Apache-2.0
// sample_around.cpp - the SIMD twin of sample_cross_ref.
//
// Along an axis a cell is linear, so an end in its point's cell follows from the distance and the
// slope there. The others are listed, and sampled together.
#include "kernels/field/sample_around.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/sample_around.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

constexpr std::size_t kBatch = 64;  // points; a multiple of every vector length
constexpr int kEnds = 6;

// Ends outside the cells of their points.
struct Elsewhere {
  static constexpr std::size_t kRoom = kEnds * kBatch + hn::MaxLanes(DF());
  std::size_t count = 0;
  float at[3][kRoom];  // in field coordinates
  std::int32_t end[kRoom], point[kRoom];
};

// Points in cells with samples, the finest there: distance [voxel], slope along each axis, and the
// ways down and up each axis to the end of the cell [voxel].
struct Own {
  hn::Mask<DF> known;  // of the other points nothing is known
  VF distance, slope[3], down[3], up[3];
};

HWY_INLINE Own own_cells(const FieldView& field, const VF* q, hn::Mask<DF> live) {
  const DF d;
  const DI di;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  auto inside = live;
  for (int a = 0; a < 3; ++a)
    inside = hn::And(inside,
                     hn::And(hn::Ge(q[a], hn::Zero(d)),
                             hn::Le(q[a], hn::Set(d, static_cast<float>(8 * field.size[a] - 1)))));
  Axis axis[3];
  for (int a = 0; a < 3; ++a) axis[a] = split_axis(hn::IfThenElseZero(inside, q[a]), field.size[a]);
  const Cell cell = cell_of(field, axis[0], axis[1], axis[2]);
  hn::Store(cell.slot, di, at);
  const VI entry = gather_entries(field.table, at);
  const auto near = hn::And(hn::RebindMask(di, inside), hn::Gt(entry, hn::Set(di, -1)));
  Own own{hn::RebindMask(d, near), hn::Zero(d), {}, {}, {}};
  if (hn::AllFalse(di, near)) return own;  // the field may have no brick
  const VI row = hn::And(entry, hn::Set(di, ~kRefined));
  Place place{hn::IfThenElseZero(near, near_offset(row, cell.node)), hn::Set(di, kNearCorners[1]),
              hn::Set(di, kNearCorners[2])};
  Fractions in{axis[0].fraction, axis[1].fraction, axis[2].fraction};
  VF quantum = hn::Set(d, kNearQuantum);
  const auto refined = hn::And(near, hn::Gt(entry, hn::Set(di, kRefined - 1)));
  VI code = hn::Zero(di), pair[4];
  if (!hn::AllFalse(di, refined)) {
    const VI in_brick = hn::Add(
        axis[0].cell, hn::Add(hn::ShiftLeft<3>(axis[1].cell), hn::ShiftLeft<6>(axis[2].cell)));
    code = codes_of(field, row, refined, in_brick);
  }
  if (hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) {
    hn::Store(place.first, di, at);
    gather_pairs(field.bricks, at, kNearCorners, pair);
  } else {
    take_finer(field, row, code, in, place, quantum);
    gather_places(field.bricks, place, pair);
  }
  interpolate<true>(corners_of(pair), in.x, in.y, in.z, quantum, hn::Set(d, kNearQuantum),
                    own.distance, own.slope[0], own.slope[1], own.slope[2]);
  const VF size = hn::Mul(quantum, hn::Set(d, 1 / kNearQuantum)), part[3] = {in.x, in.y, in.z};
  for (int a = 0; a < 3; ++a) {
    own.down[a] = hn::Mul(part[a], size);
    own.up[a] = hn::Sub(size, own.down[a]);
  }
  return own;
}

// Lists end `end` of the points i and up whose lane is set.
HWY_INLINE void list_ends(const VF* q, int end, VF step, std::size_t i, hn::Mask<DF> some,
                          Elsewhere& other) {
  const DF d;
  const DI di;
  const std::size_t n = other.count;
  for (int a = 0; a < 3; ++a) {
    const VF at = hn::MulAdd(step, hn::Set(d, static_cast<float>(kEndSign[end][a])), q[a]);
    hn::StoreU(compress(d, at, some), d, other.at[a] + n);
  }
  const VI point = hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(i)));
  hn::StoreU(compress(di, point, hn::RebindMask(di, some)), di, other.point + n);
  hn::StoreU(hn::Set(di, end), di, other.end + n);
  other.count += hn::CountTrue(d, some);
}

// The ends of the points first + i and up that lie in their cells; the others are listed.
HWY_INLINE void near_ends(const FieldView& field, const Affine& to_field, const PointsView& points,
                          float step, std::size_t first, std::size_t i, float* const* at,
                          Elsewhere& other) {
  const DF d;
  const std::size_t k = first + i, live = points.count - k;
  const VF x = load_n(d, points.x + k, live), y = load_n(d, points.y + k, live);
  const VF z = load_n(d, points.z + k, live), way = hn::Set(d, step);
  VF q[3];
  for (int a = 0; a < 3; ++a) q[a] = affine_row(to_field.m[a], x, y, z);
  const auto alive = hn::FirstN(d, live);
  const Own own = own_cells(field, q, alive);
  HWY_UNROLL(3)
  for (int a = 0; a < 3; ++a) {
    const VF more = hn::Mul(way, own.slope[a]);
    store_n(hn::Add(own.distance, more), d, at[2 * a] + k, live);
    store_n(hn::Sub(own.distance, more), d, at[2 * a + 1] + k, live);
    const auto up = hn::AndNot(hn::And(own.known, hn::Le(way, own.up[a])), alive);
    const auto down = hn::AndNot(hn::And(own.known, hn::Le(way, own.down[a])), alive);
    list_ends(q, 2 * a, way, i, up, other);
    list_ends(q, 2 * a + 1, way, i, down, other);
  }
}

// Samples a vector of listed ends, from the k-th on.
HWY_INLINE void sample_listed(const FieldView& field, const Elsewhere& other, std::size_t k,
                              std::size_t first, float* const* at) {
  const DF d;
  const std::size_t live = HWY_MIN(hn::Lanes(d), other.count - k);
  const auto alive = hn::FirstN(d, live);
  VF q[3], value, none;
  for (int a = 0; a < 3; ++a) q[a] = hn::IfThenElseZero(alive, hn::LoadU(d, other.at[a] + k));
  sample_points<false>(field, q[0], q[1], q[2], value, none, none, none);
  HWY_ALIGN float out[hn::MaxLanes(d)];
  hn::Store(value, d, out);
  for (std::size_t i = 0; i < live; ++i)
    at[other.end[k + i]][first + static_cast<std::size_t>(other.point[k + i])] = out[i];
}

void cross_simd(const FieldView& field, const Affine& to_field, const PointsView& points,
                float step, float* const* at) {
  const std::size_t width = hn::Lanes(DF());
  Elsewhere other;
  for (std::size_t first = 0; first < points.count; first += kBatch) {
    const std::size_t some = HWY_MIN(kBatch, points.count - first);
    other.count = 0;
    for (std::size_t i = 0; i < some; i += width)
      near_ends(field, to_field, points, step, first, i, at, other);
    for (std::size_t k = 0; k < other.count; k += width) sample_listed(field, other, k, first, at);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(cross_simd);

void sample_cross(const FieldView& field, const Affine& to_field, const PointsView& points,
                  float step, float* const at[6]) {
  HWY_DYNAMIC_DISPATCH(cross_simd)(field, to_field, points, step, at);
}

}  // namespace h6::kernels
#endif
