// SPDX-License-Identifier: Apache-2.0
// sample_around.cpp - the SIMD twin of sample_cross_ref.
//
// Each axis has three values, which the ends share. Some points at a time go through three
// loops: find the cells, look their bricks up, sample. So no lane waits for the memory of the step
// before, and indices go through memory, which is cheaper than taking them out of a register.
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

// On each axis an end lies on one of two sides, or beside the point.
constexpr int kEnds = 6, kSides = 3;
constexpr float kSide[kSides] = {-1, 0, 1};
constexpr int side_of(int end, int axis) { return kEndSign[end][axis] + 1; }

struct Batch {
  HWY_ALIGN float fraction[3][kSides][kBatch];  // by axis and side
  HWY_ALIGN std::int32_t slot[kEnds][kBatch];   // index in the table, then its entry
  HWY_ALIGN std::int32_t node[kEnds][kBatch];   // then byte offset in the bricks
  bool plain[kBatch];                           // of a vector's first point: all ends lie in bricks
};

// Places in cut cells. They are sampled together, after the others.
struct CutPlaces {
  static constexpr std::size_t kRoom = kEnds * kBatch + hn::MaxLanes(DF());
  std::size_t count = 0;
  std::int32_t row[kRoom], code[kRoom];  // of their bricks, of their cells
  float fraction[3][kRoom];
  std::int32_t place[kRoom], point[kRoom];
};

// The sides of an axis for a vector of points.
struct Sides {
  VF at[kSides];
};
HWY_INLINE Sides sides_of(const float* m, VF x, VF y, VF z, float step) {
  Sides sides;
  HWY_UNROLL(3)
  for (int s = 0; s < kSides; ++s) {
    const float row[4] = {m[0], m[1], m[2], m[3] + step * kSide[s]};
    sides.at[s] = affine_row(row, x, y, z);
  }
  return sides;
}

HWY_INLINE void locate(const FieldView& field, const Affine& to_field, const PointsView& points,
                       float step, std::size_t first, std::size_t i, Batch& batch) {
  const DF d;
  const DI di;
  const std::size_t live = points.count - first - i;
  const VF x = load_n(d, points.x + first + i, live), y = load_n(d, points.y + first + i, live);
  const VF z = load_n(d, points.z + first + i, live);
  const VF zero = hn::Zero(d);
  Sides q[3];
  auto inside = hn::FirstN(d, live);
  HWY_UNROLL(3)
  for (int a = 0; a < 3; ++a) {
    q[a] = sides_of(to_field.m[a], x, y, z, step);
    const VF last = hn::Set(d, static_cast<float>(8 * field.size[a] - 1));
    inside = hn::And(inside, hn::And(hn::Ge(q[a].at[0], zero), hn::Le(q[a].at[kSides - 1], last)));
  }
  batch.plain[i] = hn::CountTrue(d, inside) >= HWY_MIN(live, hn::Lanes(d));
  Axis axis[3][kSides];
  for (int a = 0; a < 3; ++a)
    for (int s = 0; s < kSides; ++s) {
      axis[a][s] = split_axis(hn::IfThenElseZero(inside, q[a].at[s]), field.size[a]);
      hn::Store(axis[a][s].fraction, d, batch.fraction[a][s] + i);
    }
  HWY_UNROLL(6)
  for (int c = 0; c < kEnds; ++c) {
    const Cell cell =
        cell_of(field, axis[0][side_of(c, 0)], axis[1][side_of(c, 1)], axis[2][side_of(c, 2)]);
    hn::Store(cell.slot, di, batch.slot[c] + i);
    hn::Store(cell.node, di, batch.node[c] + i);
  }
}

// Lists the lanes whose place has a code.
HWY_INLINE void list_cut(const Batch& batch, int place, std::size_t i, VI row, VI code,
                         CutPlaces& cut) {
  const DF d;
  const DI di;
  const auto some = hn::Ne(code, hn::Zero(di));
  const std::size_t n = cut.count;
  const auto put = [&](VI from, std::int32_t* to)
                       HWY_ATTR { hn::StoreU(compress(di, from, some), di, to + n); };
  put(row, cut.row), put(code, cut.code);
  put(hn::Set(di, place), cut.place);
  put(hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(i))), cut.point);
  HWY_UNROLL(3)
  for (int a = 0; a < 3; ++a)
    hn::StoreU(
        compress(d, hn::Load(d, batch.fraction[a][side_of(place, a)] + i), hn::RebindMask(d, some)),
        d, cut.fraction[a] + n);
  cut.count += hn::CountTrue(di, some);
}

// Lists the places in cut cells of a vector of points.
HWY_NOINLINE void list_cut_cells(const FieldView& field, const Batch& batch, std::size_t live,
                                 std::size_t i, CutPlaces& cut) {
  const DI di;
  for (int c = 0; c < kEnds; ++c) {
    const VI entry = hn::Load(di, batch.slot[c] + i);
    const auto refined = hn::And(hn::FirstN(di, live), hn::Gt(entry, hn::Set(di, kRefined - 1)));
    if (hn::AllFalse(di, refined)) continue;
    const VI row = hn::And(entry, hn::Set(di, ~kRefined));
    const VI node =
        hn::ShiftRight<1>(hn::Sub(hn::Load(di, batch.node[c] + i), near_offset(row, hn::Zero(di))));
    const VI code = codes_of(field, row, refined, cell_at(node));
    if (!hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) list_cut(batch, c, i, row, code, cut);
  }
}

HWY_INLINE void look_up(const FieldView& field, std::size_t live, std::size_t i, Batch& batch,
                        CutPlaces& cut) {
  const DI di;
  auto beyond_any = hn::FirstN(di, 0), refined = beyond_any;
  HWY_UNROLL(6)
  for (int c = 0; c < kEnds; ++c) {
    const VI entry = gather_entries(field.table, batch.slot[c] + i);
    hn::Store(entry, di, batch.slot[c] + i);
    const auto beyond = hn::Lt(entry, hn::Zero(di));
    beyond_any = hn::Or(beyond_any, beyond);
    refined = hn::Or(refined, hn::Gt(entry, hn::Set(di, kRefined - 1)));
    const VI first =
        near_offset(hn::And(entry, hn::Set(di, ~kRefined)), hn::Load(di, batch.node[c] + i));
    hn::Store(hn::IfThenZeroElse(beyond, first), di, batch.node[c] + i);
  }
  batch.plain[i] = batch.plain[i] && hn::AllFalse(di, hn::And(beyond_any, hn::FirstN(di, live)));
  if (HWY_UNLIKELY(!hn::AllFalse(di, refined)) && batch.plain[i])
    list_cut_cells(field, batch, live, i, cut);
}

HWY_INLINE void sample_plain(const FieldView& field, const Batch& batch, std::size_t live,
                             std::size_t i, float* const* at, std::size_t to) {
  const DF d;
  const VF quantum = hn::Set(d, kNearQuantum);
  HWY_UNROLL(6)
  for (int c = 0; c < kEnds; ++c) {
    VI pair[4];
    gather_pairs(field.bricks, batch.node[c] + i, kNearCorners, pair);
    VF value, none;
    interpolate<false>(corners_of(pair), hn::Load(d, batch.fraction[0][side_of(c, 0)] + i),
                       hn::Load(d, batch.fraction[1][side_of(c, 1)] + i),
                       hn::Load(d, batch.fraction[2][side_of(c, 2)] + i), quantum, quantum, value,
                       none, none, none);
    store_n(value, d, at[c] + to, live);
  }
}

// Samples a vector of places in cut cells, from the k-th on.
HWY_INLINE void sample_cut(const FieldView& field, const CutPlaces& cut, std::size_t k,
                           std::size_t first, float* const* at) {
  const DF d;
  const DI di;
  const VF unit = hn::Set(d, kNearQuantum);
  const std::size_t live = HWY_MIN(hn::Lanes(d), cut.count - k);
  const auto alive = hn::FirstN(di, live);
  const auto read = [&](const std::int32_t* from)
                        HWY_ATTR { return hn::IfThenElseZero(alive, hn::LoadU(di, from + k)); };
  Fractions in{hn::LoadU(d, cut.fraction[0] + k), hn::LoadU(d, cut.fraction[1] + k),
               hn::LoadU(d, cut.fraction[2] + k)};
  Place place{hn::Zero(di), hn::Zero(di), hn::Zero(di)};
  VF quantum = unit, value, none;
  take_finer(field, read(cut.row), read(cut.code), in, place, quantum);
  VI pair[4];
  gather_places(field.bricks, place, pair);
  interpolate<false>(corners_of(pair), in.x, in.y, in.z, quantum, unit, value, none, none, none);
  HWY_ALIGN float out[hn::MaxLanes(d)];
  hn::Store(value, d, out);
  for (std::size_t i = 0; i < live; ++i)
    at[cut.place[k + i]][first + static_cast<std::size_t>(cut.point[k + i])] = out[i];
}

// Points with a place in a far cell or outside the grid.
HWY_NOINLINE void sample_anew(const FieldView& field, const Affine& to_field,
                              const PointsView& points, float step, std::size_t k,
                              float* const* at) {
  const DF d;
  const std::size_t live = points.count - k;
  const VF x = load_n(d, points.x + k, live), y = load_n(d, points.y + k, live);
  const VF z = load_n(d, points.z + k, live);
  Sides q[3];
  for (int a = 0; a < 3; ++a) q[a] = sides_of(to_field.m[a], x, y, z, step);
  for (int c = 0; c < kEnds; ++c) {
    VF value, none;
    sample_points<false>(field, q[0].at[side_of(c, 0)], q[1].at[side_of(c, 1)],
                         q[2].at[side_of(c, 2)], value, none, none, none);
    store_n(value, d, at[c] + k, live);
  }
}

void cross_simd(const FieldView& field, const Affine& to_field, const PointsView& points,
                float step, float* const* at) {
  const std::size_t width = hn::Lanes(DF());
  Batch batch;
  CutPlaces cut;
  for (std::size_t first = 0; first < points.count; first += kBatch) {
    const std::size_t some = HWY_MIN(kBatch, points.count - first);
    for (std::size_t i = 0; i < some; i += width)
      locate(field, to_field, points, step, first, i, batch);
    cut.count = 0;
    for (std::size_t i = 0; i < some; i += width) look_up(field, some - i, i, batch, cut);
    for (std::size_t i = 0; i < some; i += width) {
      if (HWY_LIKELY(batch.plain[i]))
        sample_plain(field, batch, some - i, i, at, first + i);
      else
        sample_anew(field, to_field, points, step, first + i, at);
    }
    for (std::size_t k = 0; k < cut.count; k += width) sample_cut(field, cut, k, first, at);
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
