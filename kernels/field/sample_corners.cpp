// SPDX-License-Identifier: Apache-2.0
// sample_corners.cpp - the SIMD twin of sample_corners_ref.cpp.
//
// Each axis has two places, which the corners share. Some points at a time go through three loops:
// find the cells, look their bricks up, sample. So no lane waits for the memory of the step before,
// and indices go through memory, which is cheaper than taking them out of a register.
#include "kernels/field/sample_corners.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/field/sample_corners.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

constexpr std::size_t kBatch = 64;  // points; a multiple of every vector length

constexpr int side(int corner, int axis) { return kCornerSign[corner][axis] > 0; }

struct Batch {
  HWY_ALIGN float fraction[3][2][kBatch];  // axis, below or above the point
  HWY_ALIGN std::int32_t slot[4][kBatch];  // index in the table
  HWY_ALIGN std::int32_t node[4][kBatch];  // then byte offset in the bricks
  bool plain[kBatch];                      // of a vector's first point: all corners lie in bricks
  // Points with a corner in a cut cell, by their number in the batch.
  HWY_ALIGN std::int32_t cut[kBatch];
  std::size_t cut_count = 0;
  std::uint32_t cut_point[kBatch];
};

// The two places of an axis for a vector of points.
struct Sides {
  VF at[2];
};
HWY_INLINE Sides sides_of(const float* m, VF x, VF y, VF z, float step) {
  float row[4] = {m[0], m[1], m[2], m[3] - step};
  Sides s;
  s.at[0] = affine_row(row, x, y, z);
  row[3] = m[3] + step;
  s.at[1] = affine_row(row, x, y, z);
  return s;
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
    inside = hn::And(inside, hn::And(hn::Ge(q[a].at[0], zero), hn::Le(q[a].at[1], last)));
  }
  batch.plain[i] = hn::CountTrue(d, inside) >= HWY_MIN(live, hn::Lanes(d));
  Axis axis[3][2];
  for (int a = 0; a < 3; ++a)
    for (int s = 0; s < 2; ++s) {
      axis[a][s] = split_axis(hn::IfThenElseZero(inside, q[a].at[s]), field.size[a]);
      hn::Store(axis[a][s].fraction, d, batch.fraction[a][s] + i);
    }
  HWY_UNROLL(4)
  for (int c = 0; c < 4; ++c) {
    const Cell cell = cell_of(field, axis[0][side(c, 0)], axis[1][side(c, 1)], axis[2][side(c, 2)]);
    hn::Store(cell.slot, di, batch.slot[c] + i);
    hn::Store(cell.node, di, batch.node[c] + i);
  }
}

// The codes of the cells of refined bricks, from their first nodes.
HWY_INLINE VI codes_at(const FieldView& field, VI row, hn::Mask<DI> refined, VI node) {
  const DF d;
  const DI di;
  // node = x + 9 y + 81 z, each below 8: exact in float, and no multiple of a ninth is near.
  const auto over = [&](VI n, float share) HWY_ATTR {
    return hn::ConvertTo(
        di, hn::Mul(hn::Add(hn::ConvertTo(d, n), hn::Set(d, 0.5f)), hn::Set(d, share)));
  };
  const VI z = over(node, 1.0f / 81), rest = hn::Sub(node, hn::Mul(z, hn::Set(di, 81)));
  const VI y = over(rest, 1.0f / 9), x = hn::Sub(rest, hn::Mul(y, hn::Set(di, 9)));
  return codes_of(field, row, refined, {z, x, hn::Zero(d)}, {z, y, hn::Zero(d)},
                  {z, z, hn::Zero(d)});
}

HWY_INLINE void look_up(const FieldView& field, std::size_t live, std::size_t i, Batch& batch) {
  const DI di;
  auto other = hn::FirstN(di, 0);
  VI codes = hn::Zero(di);
  HWY_UNROLL(4)
  for (int c = 0; c < 4; ++c) {
    const VI entry = gather_entries(field.table, batch.slot[c] + i);
    const auto beyond = hn::Lt(entry, hn::Zero(di));
    other = hn::Or(other, beyond);
    const VI row = hn::And(entry, hn::Set(di, ~kRefined));
    const VI node = hn::Load(di, batch.node[c] + i);
    const auto refined = hn::Gt(entry, hn::Set(di, kRefined - 1));
    if (!hn::AllFalse(di, refined)) codes = hn::Or(codes, codes_at(field, row, refined, node));
    hn::Store(hn::IfThenZeroElse(beyond, near_offset(row, node)), di, batch.node[c] + i);
  }
  batch.plain[i] = batch.plain[i] && hn::AllFalse(di, hn::And(other, hn::FirstN(di, live)));
  if (!batch.plain[i] || hn::AllTrue(di, hn::Eq(codes, hn::Zero(di)))) return;
  hn::Store(codes, di, batch.cut + i);
  for (std::size_t k = i; k < i + HWY_MIN(live, hn::Lanes(di)); ++k) {
    batch.cut_point[batch.cut_count] = static_cast<std::uint32_t>(k);
    batch.cut_count += batch.cut[k] != 0;
  }
}

HWY_INLINE void sample_plain(const FieldView& field, const Batch& batch, std::size_t live,
                             std::size_t i, float* const at[4], std::size_t to) {
  const DF d;
  const VF quantum = hn::Set(d, kNearQuantum);
  HWY_UNROLL(4)
  for (int c = 0; c < 4; ++c) {
    VI pair[4];
    gather_pairs(field.bricks, batch.node[c] + i, kNearCorners, pair);
    VF value, none;
    interpolate<false>(corners_of(pair), hn::Load(d, batch.fraction[0][side(c, 0)] + i),
                       hn::Load(d, batch.fraction[1][side(c, 1)] + i),
                       hn::Load(d, batch.fraction[2][side(c, 2)] + i), quantum, quantum, value,
                       none, none, none);
    store_n(value, d, at[c] + to, live);
  }
}

// Points whose corners lie in bricks, some in cut cells; a vector of them at most.
HWY_NOINLINE void sample_cut(const FieldView& field, const Affine& to_field,
                             const PointsView& points, float step, std::size_t first,
                             const std::uint32_t* which, std::size_t count, float* const at[4]) {
  const DF d;
  HWY_ALIGN float column[3][hn::MaxLanes(d)] = {};
  HWY_ALIGN float out[hn::MaxLanes(d)];
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const std::size_t row = first + which[HWY_MIN(i, count - 1)];
    column[0][i] = points.x[row], column[1][i] = points.y[row], column[2][i] = points.z[row];
  }
  const VF x = hn::Load(d, column[0]), y = hn::Load(d, column[1]), z = hn::Load(d, column[2]);
  Sides q[3];
  for (int a = 0; a < 3; ++a) q[a] = sides_of(to_field.m[a], x, y, z, step);
  for (int c = 0; c < 4; ++c) {
    VF value, none;
    sample_inside<false, false>(field, q[0].at[side(c, 0)], q[1].at[side(c, 1)],
                                q[2].at[side(c, 2)], value, none, none, none);
    hn::Store(value, d, out);
    for (std::size_t i = 0; i < count; ++i) at[c][first + which[i]] = out[i];
  }
}

// Points with a corner in a far cell or outside the grid.
HWY_NOINLINE void sample_anew(const FieldView& field, const Affine& to_field,
                              const PointsView& points, float step, std::size_t k,
                              float* const at[4]) {
  const DF d;
  const std::size_t live = points.count - k;
  const VF x = load_n(d, points.x + k, live), y = load_n(d, points.y + k, live);
  const VF z = load_n(d, points.z + k, live);
  Sides q[3];
  for (int a = 0; a < 3; ++a) q[a] = sides_of(to_field.m[a], x, y, z, step);
  for (int c = 0; c < 4; ++c) {
    VF value, none;
    sample_points<false>(field, q[0].at[side(c, 0)], q[1].at[side(c, 1)], q[2].at[side(c, 2)],
                         value, none, none, none);
    store_n(value, d, at[c] + k, live);
  }
}

void sample_corners_simd(const FieldView& field, const Affine& to_field, const PointsView& points,
                         float step, float* const at[4]) {
  const std::size_t width = hn::Lanes(DF());
  Batch batch;
  for (std::size_t first = 0; first < points.count; first += kBatch) {
    const std::size_t some = HWY_MIN(kBatch, points.count - first);
    for (std::size_t i = 0; i < some; i += width)
      locate(field, to_field, points, step, first, i, batch);
    batch.cut_count = 0;
    for (std::size_t i = 0; i < some; i += width) look_up(field, some - i, i, batch);
    for (std::size_t i = 0; i < some; i += width) {
      if (HWY_LIKELY(batch.plain[i]))
        sample_plain(field, batch, some - i, i, at, first + i);
      else
        sample_anew(field, to_field, points, step, first + i, at);
    }
    for (std::size_t i = 0; i < batch.cut_count; i += width)
      sample_cut(field, to_field, points, step, first, batch.cut_point + i,
                 HWY_MIN(width, batch.cut_count - i), at);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sample_corners_simd);

void sample_corners(const FieldView& field, const Affine& to_field, const PointsView& points,
                    float step, float* const at[4]) {
  HWY_DYNAMIC_DISPATCH(sample_corners_simd)(field, to_field, points, step, at);
}

}  // namespace h6::kernels
#endif
