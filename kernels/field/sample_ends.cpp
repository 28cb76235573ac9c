// SPDX-License-Identifier: Apache-2.0
// sample_ends.cpp - the SIMD twin of sample_ends_ref.
//
// The ends of a cross of one voxel lie in the six cells beside the point's own, each at the point's
// place in its cell, and the places half-way there lie in these cells or in its own. All seven
// cells have 32 nodes, since every node of the point's own is in three of the others; so 16 pairs
// are fetched in place of 24. Some points at a time go through three loops, as in
// sample_around.cpp. While it gave the six ends alone, and each fetched its own nodes, this kernel
// took 1.12 times as long, and a frame of 1,000 contacts 1.05 times (kernels/sample_ends,
// frame/clutter, frame/conforming; AVX2).
#include "kernels/field/sample_around.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/sample_ends.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

constexpr std::size_t kBatch = 64;  // points; a multiple of every vector length
constexpr int kEnds = 6;

struct EndBatch {
  HWY_ALIGN float fraction[3][kBatch];
  HWY_ALIGN std::int32_t slot[kEnds][kBatch];  // index in the table
  HWY_ALIGN std::int32_t node[kEnds][kBatch];  // then byte offset in the bricks
  HWY_ALIGN std::int32_t plain[kBatch];  // not 0: all ends lie in bricks without finer samples
};

struct Places {
  VF x, y, z;
};
HWY_INLINE Places places_of(const Affine& to_field, const PointsView& points, std::size_t i) {
  const DF d;
  const std::size_t live = points.count - i;
  const VF x = load_n(d, points.x + i, live), y = load_n(d, points.y + i, live);
  const VF z = load_n(d, points.z + i, live);
  return {affine_row(to_field.m[0], x, y, z), affine_row(to_field.m[1], x, y, z),
          affine_row(to_field.m[2], x, y, z)};
}

// Holds the cell of a point on one axis, and the cells before and behind it.
struct ThreeCells {
  Axis at[3];
};
HWY_INLINE ThreeCells three_cells(VF q, std::int32_t bricks) {
  const DI di;
  const VI unit = hn::Min(hn::ConvertTo(di, q), hn::Set(di, 8 * bricks - 3));
  const VF fraction = hn::Sub(q, hn::ConvertTo(DF(), unit));
  ThreeCells cells;
  HWY_UNROLL(3)
  for (int s = 0; s < 3; ++s) {
    const VI one = hn::Add(unit, hn::Set(di, s - 1));
    cells.at[s] = {hn::ShiftRight<3>(one), hn::And(one, hn::Set(di, 7)), fraction};
  }
  return cells;
}

HWY_INLINE void locate_ends(const FieldView& field, const Affine& to_field,
                            const PointsView& points, std::size_t first, std::size_t i,
                            EndBatch& batch) {
  const DF d;
  const DI di;
  const std::size_t live = points.count - first - i;
  const Places q = places_of(to_field, points, first + i);
  const VF along[3] = {q.x, q.y, q.z}, one = hn::Set(d, 1.0f);
  auto inside = hn::FirstN(d, live);
  for (int a = 0; a < 3; ++a) {
    const VF last = hn::Set(d, static_cast<float>(8 * field.size[a] - 2));
    inside = hn::And(inside, hn::And(hn::Ge(along[a], one), hn::Le(along[a], last)));
  }
  hn::Store(hn::VecFromMask(di, hn::RebindMask(di, inside)), di, batch.plain + i);
  ThreeCells cells[3];
  for (int a = 0; a < 3; ++a) {
    cells[a] = three_cells(hn::IfThenElse(inside, along[a], one), field.size[a]);
    hn::Store(cells[a].at[1].fraction, d, batch.fraction[a] + i);
  }
  HWY_UNROLL(6)
  for (int c = 0; c < kEnds; ++c) {
    const auto axis = [&](int a) HWY_ATTR { return cells[a].at[kEndSign[c][a] + 1]; };
    const Cell cell = cell_of(field, axis(0), axis(1), axis(2));
    hn::Store(cell.slot, di, batch.slot[c] + i);
    hn::Store(cell.node, di, batch.node[c] + i);
  }
}

HWY_INLINE void look_up_ends(const FieldView& field, std::size_t i, EndBatch& batch) {
  const DI di;
  auto other = hn::FirstN(di, 0);
  HWY_UNROLL(6)
  for (int c = 0; c < kEnds; ++c) {
    const VI entry = gather_entries(field.table, batch.slot[c] + i);
    const auto here = hn::Or(hn::Lt(entry, hn::Zero(di)), hn::Gt(entry, hn::Set(di, kRefined - 1)));
    other = hn::Or(other, here);
    const VI first = near_offset(entry, hn::Load(di, batch.node[c] + i));
    hn::Store(hn::IfThenZeroElse(here, first), di, batch.node[c] + i);
  }
  const VI plain = hn::Load(di, batch.plain + i);
  hn::Store(hn::IfThenZeroElse(other, plain), di, batch.plain + i);
}

// Fetches two rows beside the point's cell and interpolates each along x. `behind`: the bytes from
// the first node of the end's cell to each.
HWY_INLINE void two_rows(const FieldView& field, const std::int32_t* at, const int (&behind)[2],
                         VF x, VF (&row)[2]) {
  VI pair[2];
  gather_pairs(field.bricks, at, behind, pair);
  for (int k = 0; k < 2; ++k) row[k] = lerp(low_half(pair[k]), high_half(pair[k]), x);
}

// Along one axis the distance is linear from plane to plane of nodes. Writes the values at the ends
// of the cross and half-way there. `plane`: bilinear in the planes before the point's cell, of the
// cell and behind it; t: the point's place between the middle ones.
HWY_INLINE void put_axis(int axis, const VF (&plane)[4], VF t, std::size_t live, float* const* at,
                         std::size_t to) {
  const DF d;
  const VF quantum = hn::Set(d, kNearQuantum), half = hn::Set(d, 0.5f);
  const auto put = [&](int column, VF value)
                       HWY_ATTR { store_n(hn::Mul(value, quantum), d, at[column] + to, live); };
  put(2 * axis, lerp(plane[2], plane[3], t));
  put(2 * axis + 1, lerp(plane[0], plane[1], t));
  const auto low = hn::Lt(t, half);
  const VF u = hn::IfThenElse(low, hn::Add(t, half), hn::Sub(t, half));
  const VF first = hn::IfThenElse(low, plane[0], plane[1]);
  const VF middle = hn::IfThenElse(low, plane[1], plane[2]);
  const VF last = hn::IfThenElse(low, plane[2], plane[3]);
  put(kEnds + 2 * axis, lerp(middle, last, u));
  put(kEnds + 2 * axis + 1, lerp(first, middle, u));
}

HWY_INLINE void sample_between(const FieldView& field, const EndBatch& batch, std::size_t live,
                               std::size_t i, float* const* at, std::size_t to) {
  const DF d;
  const VF x = hn::Load(d, batch.fraction[0] + i), y = hn::Load(d, batch.fraction[1] + i);
  const VF z = hn::Load(d, batch.fraction[2] + i);
  constexpr const int(&c)[4] = kNearCorners;
  VI ahead[4], before[4];
  gather_pairs(field.bricks, batch.node[0] + i, c, ahead);
  gather_pairs(field.bricks, batch.node[1] + i, c, before);
  // Rows are y0z0, y1z0, y0z1, y1z1.
  VF node[4][4], row[4], plane[4];
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k) {
    node[0][k] = low_half(before[k]), node[1][k] = high_half(before[k]);
    node[2][k] = low_half(ahead[k]), node[3][k] = high_half(ahead[k]);
    row[k] = lerp(node[1][k], node[2][k], x);
  }
  HWY_UNROLL(4)
  for (int k = 0; k < 4; ++k)
    plane[k] = lerp(lerp(node[k][0], node[k][1], y), lerp(node[k][2], node[k][3], y), z);
  put_axis(0, plane, x, live, at, to);
  VF far[2];
  two_rows(field, batch.node[3] + i, {c[0], c[2]}, x, far);
  plane[0] = lerp(far[0], far[1], z);
  plane[1] = lerp(row[0], row[2], z), plane[2] = lerp(row[1], row[3], z);
  two_rows(field, batch.node[2] + i, {c[1], c[3]}, x, far);
  plane[3] = lerp(far[0], far[1], z);
  put_axis(1, plane, y, live, at, to);
  two_rows(field, batch.node[5] + i, {c[0], c[1]}, x, far);
  plane[0] = lerp(far[0], far[1], y);
  plane[1] = lerp(row[0], row[1], y), plane[2] = lerp(row[2], row[3], y);
  two_rows(field, batch.node[4] + i, {c[2], c[3]}, x, far);
  plane[3] = lerp(far[0], far[1], y);
  put_axis(2, plane, z, live, at, to);
}

// Samples the points that have an end outside the grid, in a far cell or in a brick with finer
// samples. Others keep their values, so no point's bits depend on its neighbours.
HWY_NOINLINE void sample_ends_anew(const FieldView& field, const Affine& to_field,
                                   const PointsView& points, std::size_t k, hn::Mask<DF> plain,
                                   float* const* at) {
  const DF d;
  const std::size_t live = points.count - k;
  for (int c = 0; c < 2 * kEnds; ++c) {
    Affine to = to_field;
    const float step = c < kEnds ? 1.0f : 0.5f;
    for (int a = 0; a < 3; ++a) to.m[a][3] += step * static_cast<float>(kEndSign[c % kEnds][a]);
    const Places q = places_of(to, points, k);
    VF value, none;
    sample_points<false>(field, q.x, q.y, q.z, value, none, none, none);
    value = hn::IfThenElse(plain, load_n(d, at[c] + k, live), value);
    store_n(value, d, at[c] + k, live);
  }
}

void ends_simd(const FieldView& field, const Affine& to_field, const PointsView& points,
               float* const* at) {
  const DF d;
  const DI di;
  const std::size_t width = hn::Lanes(d);
  EndBatch batch;
  for (std::size_t first = 0; first < points.count; first += kBatch) {
    const std::size_t some = HWY_MIN(kBatch, points.count - first);
    for (std::size_t i = 0; i < some; i += width)
      locate_ends(field, to_field, points, first, i, batch);
    for (std::size_t i = 0; i < some; i += width) look_up_ends(field, i, batch);
    for (std::size_t i = 0; i < some; i += width) {
      const auto plain = hn::RebindMask(d, hn::Ne(hn::Load(di, batch.plain + i), hn::Zero(di)));
      // A field may have no bricks at all.
      if (HWY_LIKELY(!hn::AllFalse(d, plain)))
        sample_between(field, batch, some - i, i, at, first + i);
      if (HWY_UNLIKELY(hn::CountTrue(d, plain) < HWY_MIN(some - i, width)))
        sample_ends_anew(field, to_field, points, first + i, plain, at);
    }
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(ends_simd);

void sample_ends(const FieldView& field, const Affine& to_field, const PointsView& points,
                 float* const at[12]) {
  HWY_DYNAMIC_DISPATCH(ends_simd)(field, to_field, points, at);
}

}  // namespace h6::kernels
#endif
