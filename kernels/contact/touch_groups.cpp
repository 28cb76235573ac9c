// SPDX-License-Identifier: Apache-2.0
// touch_groups.cpp - the SIMD twin of touch_groups_ref.cpp.
#include "kernels/contact/touch_groups.h"

#include <hwy/cache_control.h>

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/touch_groups.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/field/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// The points to sample are staged, those of one group behind those of another, some groups at a
// time. Sixteen points, a batch, then go through four steps: find their entry in the table, their
// cell in the bricks, its finer samples where it is cut, their samples. The steps run some batches
// apart, so that none waits for the memory of the one before. When the field is cold, each step
// also prefetches for the next.
//
//     batch  k + ahead: locate   k + ahead / 2: look_up   k + ahead / 4: find_finer   k: sample
constexpr std::size_t kStaged = 32;  // groups
constexpr std::size_t kRing = 16;
constexpr std::size_t kAhead = 4;  // batches, when the field is in the caches; else kRing

struct Stage {
  static constexpr std::size_t kRoom = (kStaged + 1) * kGroup;
  HWY_ALIGN float x[kRoom], y[kRoom], z[kRoom], distance[kRoom], limit[kRoom];
  HWY_ALIGN std::int32_t row[kRoom];
  std::size_t first[kStaged + 1];  // staged point of each group; then the number of points
};

struct Ring {
  HWY_ALIGN std::int32_t slot[kRing][kGroup];  // index in the table; after look_up the entry there
  HWY_ALIGN std::int32_t node[kRing][kGroup];  // first node of the cell; then its byte offset
  HWY_ALIGN float fraction[3][kRing][kGroup];
  bool plain[kRing];  // all points lie in bricks
  bool mixed[kRing];  // all lie in the grid, some in far cells, none in refined bricks
  // All points lie in bricks, and some of these are refined; after find_finer, some cells are cut.
  bool cut[kRing];
  // Filled for such batches only: bytes to the next row and plane, and the unit of the samples.
  HWY_ALIGN std::int32_t line[kRing][kGroup], plane[kRing][kGroup];
  HWY_ALIGN float quantum[kRing][kGroup];
};

// The last batch is filled up with the first point.
HWY_INLINE void stage_points(const PointsView& points, const std::uint32_t* groups,
                             const std::uint16_t* rows, std::size_t count, float limit,
                             const float* reach, Stage& stage) {
  const DF d;
  const DI di;
  const VI iota = hn::Iota(di, 0), bit = hn::Shl(hn::Set(di, 1), iota);
  std::size_t n = 0;
  for (std::size_t k = 0; k < count; ++k) {
    stage.first[k] = n;
    const std::size_t first = kGroup * groups[k];
    std::uint32_t looked = rows[k];
    const VF here = hn::Set(d, reach != nullptr ? reach[groups[k]] : limit);
    if (HWY_UNLIKELY(first + kGroup > points.count))
      looked &= first < points.count ? (1u << (points.count - first)) - 1 : 0u;
    for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
      const auto chosen = hn::TestBit(hn::Set(di, static_cast<std::int32_t>(looked >> i)), bit);
      const auto put = [&](const float* from, float* to) HWY_ATTR {
        const VF v = hn::LoadU(d, from + first + i);
        hn::StoreU(compress(d, v, hn::RebindMask(d, chosen)), d, to + n);
      };
      put(points.x, stage.x);
      put(points.y, stage.y);
      put(points.z, stage.z);
      const VI row = hn::Add(iota, hn::Set(di, static_cast<std::int32_t>(first + i)));
      hn::StoreU(compress(di, row, chosen), di, stage.row + n);
      hn::StoreU(here, d, stage.limit + n);
      n += hn::CountTrue(di, chosen);
    }
  }
  stage.first[count] = n;
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d))
    for (float* column : {stage.x, stage.y, stage.z})
      hn::StoreU(hn::Set(d, column[0]), d, column + n + i);
}

HWY_INLINE void prefetch_group(const PointsView& points, std::size_t group) {
  for (const float* column : {points.x, points.y, points.z}) hwy::Prefetch(column + kGroup * group);
}

// Source of the batches: a whole group each, or the staged points.
struct WholeGroups {
  const PointsView& points;
  const std::uint32_t* groups;
  float limit;
  const float* reach;
  float* least;
  bool roughly;

  VF limit_of(std::size_t batch, std::size_t) const {
    return hn::Set(DF(), reach != nullptr ? reach[groups[batch]] : limit);
  }
  std::size_t first(std::size_t batch) const { return kGroup * groups[batch]; }
  void prefetch(std::size_t batch) const { prefetch_group(points, groups[batch]); }
  VF x(std::size_t at) const { return hn::LoadU(DF(), points.x + at); }
  VF y(std::size_t at) const { return hn::LoadU(DF(), points.y + at); }
  VF z(std::size_t at) const { return hn::LoadU(DF(), points.z + at); }
  VI row(std::size_t at) const {
    return hn::Add(hn::Iota(DI(), 0), hn::Set(DI(), static_cast<std::int32_t>(at)));
  }
  std::size_t count() const { return points.count; }
  void keep(std::size_t, VF) const {}
  void end(std::size_t batch, VF smallest) const {
    least[batch] = hn::GetLane(hn::MinOfLanes(DF(), smallest));
  }
};
struct StagedPoints {
  static constexpr bool roughly = false;
  Stage& stage;
  std::size_t number;

  VF limit_of(std::size_t, std::size_t at) const { return hn::Load(DF(), stage.limit + at); }
  std::size_t first(std::size_t batch) const { return kGroup * batch; }
  void prefetch(std::size_t) const {}
  VF x(std::size_t at) const { return hn::Load(DF(), stage.x + at); }
  VF y(std::size_t at) const { return hn::Load(DF(), stage.y + at); }
  VF z(std::size_t at) const { return hn::Load(DF(), stage.z + at); }
  VI row(std::size_t at) const { return hn::Load(DI(), stage.row + at); }
  std::size_t count() const { return number; }
  void keep(std::size_t at, VF distance) const { hn::Store(distance, DF(), stage.distance + at); }
  void end(std::size_t, VF) const {}
};

template <class Points>
HWY_INLINE void locate(const FieldView& field, const Affine& to_field, const Points& points,
                       std::size_t batch, std::size_t k, bool cold, Ring& ring) {
  const DF d;
  const DI di;
  const VF zero = hn::Zero(d);
  bool plain = true;
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
    const std::size_t at = points.first(batch) + i;
    const VF px = points.x(at), py = points.y(at), pz = points.z(at);
    VF q[3];
    auto inside = hn::FirstN(d, hn::Lanes(d));
    HWY_UNROLL(3)
    for (int a = 0; a < 3; ++a) {
      q[a] = affine_row(to_field.m[a], px, py, pz);
      const VF last = hn::Set(d, static_cast<float>(8 * field.size[a] - 1));
      inside = hn::And(inside, hn::And(hn::Ge(q[a], zero), hn::Le(q[a], last)));
    }
    plain = plain && hn::AllTrue(d, inside);
    Axis axis[3];
    HWY_UNROLL(3)
    for (int a = 0; a < 3; ++a) {
      axis[a] = split_axis(hn::IfThenElseZero(inside, q[a]), field.size[a]);
      hn::Store(axis[a].fraction, d, ring.fraction[a][k] + i);
    }
    const Cell cell = cell_of(field, axis[0], axis[1], axis[2]);
    hn::Store(cell.slot, di, ring.slot[k] + i);
    hn::Store(cell.node, di, ring.node[k] + i);
  }
  ring.plain[k] = plain;
  if (cold)
    for (const std::int32_t slot : ring.slot[k]) hwy::Prefetch(field.table + slot);
}

HWY_INLINE void prefetch_far(const FieldView& field, const std::int32_t* entry) {
  for (std::size_t i = 0; i < kGroup; ++i)
    if (entry[i] < 0) hwy::Prefetch(field.far + 8 * (-1 - std::ptrdiff_t{entry[i]}));
}

// Prefetches what find_finer reads for a batch with refined bricks.
HWY_NOINLINE void prefetch_cuts(const FieldView& field, const Ring& ring, std::size_t k) {
  const DI di;
  HWY_ALIGN std::int32_t cell[kGroup];
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(di))
    hn::Store(cell_at(hn::Load(di, ring.node[k] + i)), di, cell + i);
  for (std::size_t i = 0; i < kGroup; ++i) {
    if (ring.slot[k][i] < kRefined) continue;
    const std::uint16_t* const cuts =
        field.cuts + std::ptrdiff_t{row_of(ring.slot[k][i])} * kCutStride;
    hwy::Prefetch(cuts);
    hwy::Prefetch(cuts + kCutHead + cell[i]);
  }
}

// Finds the finer samples of a batch of points that all lie in bricks. Returns whether there are
// any. Where a tenth of the cells is cut, the general path took 1.4 times as long.
HWY_NOINLINE bool find_finer(const FieldView& field, std::size_t k, bool cold, Ring& ring) {
  const DF d;
  const DI di;
  bool any = false;
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
    const VI entry = hn::Load(di, ring.slot[k] + i);
    const VI row = hn::And(entry, hn::Set(di, ~kRefined)), node = hn::Load(di, ring.node[k] + i);
    const auto refined = hn::Gt(entry, hn::Set(di, kRefined - 1));
    const VI code = codes_of(field, row, refined, cell_at(node));
    any = any || !hn::AllTrue(di, hn::Eq(code, hn::Zero(di)));
    Fractions at{hn::Load(d, ring.fraction[0][k] + i), hn::Load(d, ring.fraction[1][k] + i),
                 hn::Load(d, ring.fraction[2][k] + i)};
    Place place{near_offset(row, node), hn::Set(di, kNearCorners[1]), hn::Set(di, kNearCorners[2])};
    VF quantum = hn::Set(d, kNearQuantum);
    take_finer(field, row, code, at, place, quantum);
    hn::Store(at.x, d, ring.fraction[0][k] + i);
    hn::Store(at.y, d, ring.fraction[1][k] + i);
    hn::Store(at.z, d, ring.fraction[2][k] + i);
    hn::Store(place.first, di, ring.node[k] + i);
    hn::Store(place.line, di, ring.line[k] + i);
    hn::Store(place.plane, di, ring.plane[k] + i);
    hn::Store(quantum, d, ring.quantum[k] + i);
  }
  const char* const bytes = reinterpret_cast<const char*>(field.bricks);
  for (std::size_t i = 0; cold && i < kGroup; ++i) {
    const char* const first = bytes + ring.node[k][i];
    hwy::Prefetch(first);
    hwy::Prefetch(first + ring.line[k][i] + ring.plane[k][i]);
  }
  return any;
}

HWY_INLINE void look_up(const FieldView& field, std::size_t k, bool cold, Ring& ring) {
  const DI di;
  auto far = hn::FirstN(di, 0), refined = far;
  VI entry[kGroup / hn::MaxLanes(DI())];
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(di)) {
    VI& e = entry[i / hn::Lanes(di)];
    e = gather_entries(field.table, ring.slot[k] + i);
    far = hn::Or(far, hn::Lt(e, hn::Zero(di)));
    refined = hn::Or(refined, hn::Gt(e, hn::Set(di, kRefined - 1)));
    hn::Store(e, di, ring.slot[k] + i);
  }
  const bool any_far = !hn::AllFalse(di, far), any_refined = !hn::AllFalse(di, refined);
  ring.mixed[k] = ring.plain[k] && any_far && !any_refined;
  ring.plain[k] = ring.plain[k] && !any_far;
  ring.cut[k] = ring.plain[k] && any_refined;
  if (HWY_UNLIKELY(ring.cut[k])) {
    if (cold) prefetch_cuts(field, ring, k);
    return;
  }
  for (std::size_t i = 0; i < kGroup; i += hn::Lanes(di)) {
    const VI e = entry[i / hn::Lanes(di)], row = hn::IfThenZeroElse(hn::Lt(e, hn::Zero(di)), e);
    hn::Store(near_offset(row, hn::Load(di, ring.node[k] + i)), di, ring.node[k] + i);
  }
  if (!cold) return;
  const char* const bytes = reinterpret_cast<const char*>(field.bricks);
  for (const std::int32_t offset : ring.node[k]) {
    hwy::Prefetch(bytes + offset + 2 * 5);
    hwy::Prefetch(bytes + offset + 2 * 86);
  }
  if (any_far) prefetch_far(field, ring.slot[k]);
}

struct Samples {
  VF distance, gx, gy, gz;
};

HWY_INLINE Samples sample_plain(const FieldView& field, const Ring& ring, std::size_t k,
                                std::size_t i) {
  const DF d;
  const VF quantum = hn::Set(d, kNearQuantum);
  VI pair[4];
  gather_pairs(field.bricks, ring.node[k] + i, kNearCorners, pair);
  Samples s;
  interpolate<true>(corners_of(pair), hn::Load(d, ring.fraction[0][k] + i),
                    hn::Load(d, ring.fraction[1][k] + i), hn::Load(d, ring.fraction[2][k] + i),
                    quantum, quantum, s.distance, s.gx, s.gy, s.gz);
  return s;
}

// Samples a vector of points of which some lie in cut cells.
HWY_NOINLINE Samples sample_cut(const FieldView& field, const Ring& ring, std::size_t k,
                                std::size_t i) {
  const DF d;
  const DI di;
  VI pair[4];
  gather_places(field.bricks,
                {hn::Load(di, ring.node[k] + i), hn::Load(di, ring.line[k] + i),
                 hn::Load(di, ring.plane[k] + i)},
                pair);
  Samples s;
  interpolate<true>(corners_of(pair), hn::Load(d, ring.fraction[0][k] + i),
                    hn::Load(d, ring.fraction[1][k] + i), hn::Load(d, ring.fraction[2][k] + i),
                    hn::Load(d, ring.quantum[k] + i), hn::Set(d, kNearQuantum), s.distance, s.gx,
                    s.gy, s.gz);
  return s;
}

// Samples a vector of a mixed batch, where points of far cells count as `band` away. Returns
// whether it could: some points must lie in bricks, and the others outside the obstacle. Without it
// the search at random poses of the refined alpha takes 1.35 times as long, of the starter 1.24
// times, along their paths 0.99 and 1.06 times (`./dev bench peers`).
HWY_INLINE bool sample_roughly(const FieldView& field, const Ring& ring, std::size_t k,
                               std::size_t i, Samples& s) {
  const DF d;
  const DI di;
  const VI entry = hn::Load(di, ring.slot[k] + i);
  const auto far = hn::Lt(entry, hn::Zero(di));
  if (hn::AllTrue(di, far)) return false;
  HWY_ALIGN std::int32_t at[hn::MaxLanes(di)];
  const VI row = hn::Sub(hn::Set(di, -1), entry);
  hn::Store(hn::IfThenElseZero(far, hn::ShiftLeft<4>(row)), di, at);
  const VI corner = hn::ShiftLeft<16>(gather_at(field.far, at));  // 0: nothing is known
  if (!hn::AllTrue(di, hn::Or(hn::Not(far), hn::Gt(corner, hn::Zero(di))))) return false;
  s = sample_plain(field, ring, k, i);
  s.distance = hn::IfThenElse(hn::RebindMask(d, far), hn::Set(d, field.band), s.distance);
  return true;
}

template <class Points>
Samples sample_anew(const FieldView& field, const Affine& to_field, const Points& points,
                    std::size_t at) {
  const VF px = points.x(at), py = points.y(at), pz = points.z(at);
  Samples s;
  sample_points<true>(field, affine_row(to_field.m[0], px, py, pz),
                      affine_row(to_field.m[1], px, py, pz), affine_row(to_field.m[2], px, py, pz),
                      s.distance, s.gx, s.gy, s.gz);
  return s;
}

// Lanes whose distance is a sample: points inside the grid, in a brick.
template <class Points>
hn::Mask<DF> in_bricks(const FieldView& field, const Affine& to_field, const Points& points,
                       std::size_t at) {
  const DF d;
  const DI di;
  const VF px = points.x(at), py = points.y(at), pz = points.z(at), zero = hn::Zero(d);
  VF q[3];
  auto inside = hn::FirstN(d, hn::Lanes(d));
  for (int a = 0; a < 3; ++a) {
    q[a] = affine_row(to_field.m[a], px, py, pz);
    const VF last = hn::Set(d, static_cast<float>(8 * field.size[a] - 1));
    inside = hn::And(inside, hn::And(hn::Ge(q[a], zero), hn::Le(q[a], last)));
  }
  const Cell cell = cell_of(field, split_axis(hn::IfThenElseZero(inside, q[0]), field.size[0]),
                            split_axis(hn::IfThenElseZero(inside, q[1]), field.size[1]),
                            split_axis(hn::IfThenElseZero(inside, q[2]), field.size[2]));
  HWY_ALIGN std::int32_t slot[hn::MaxLanes(di)];
  hn::Store(cell.slot, di, slot);
  const VI entry = gather_entries(field.table, slot);
  return hn::AndNot(hn::RebindMask(d, hn::Lt(entry, hn::Zero(di))), inside);
}

// Appends the touching points of some batches and returns the new end.
template <class Points>
HWY_INLINE std::size_t sample_batches(const FieldView& field, const Affine& to_field,
                                      const Points& points, std::size_t batches, float limit,
                                      bool cold, const Touching& out, std::size_t written) {
  const DF d;
  const DI di;
  static_assert(hn::MaxLanes(DF()) <= kGroup, "a vector is part of a batch");
  const VF none = hn::Set(d, __builtin_huge_valf());
  const std::size_t ahead = cold ? kRing : kAhead, half = ahead / 2, quarter = ahead / 4;
  Ring ring;
  const auto locate_at = [&](std::size_t k) HWY_ATTR {
    if (k < batches) locate(field, to_field, points, k, k % kRing, cold, ring);
  };
  const auto look_up_at = [&](std::size_t k) HWY_ATTR {
    if (k < batches) look_up(field, k % kRing, cold, ring);
  };
  const auto find_finer_at = [&](std::size_t k) HWY_ATTR {
    if (k < batches && HWY_UNLIKELY(ring.cut[k % kRing]))
      ring.cut[k % kRing] = find_finer(field, k % kRing, cold, ring);
  };
  for (std::size_t k = 0; k < HWY_MIN(2 * ahead, batches); ++k) points.prefetch(k);
  for (std::size_t k = 0; k < ahead; ++k) locate_at(k);
  for (std::size_t k = 0; k < half; ++k) look_up_at(k);
  for (std::size_t k = 0; k < quarter; ++k) find_finer_at(k);
  for (std::size_t k = 0; k < batches; ++k) {
    look_up_at(k + half);
    find_finer_at(k + quarter);
    VF smallest = none;
    for (std::size_t i = 0; i < kGroup; i += hn::Lanes(d)) {
      const std::size_t at = points.first(k) + i;
      const std::size_t r = k % kRing;
      Samples s;
      if (HWY_LIKELY(ring.plain[r]))
        s = HWY_UNLIKELY(ring.cut[r]) ? sample_cut(field, ring, r, i)
                                      : sample_plain(field, ring, r, i);
      else if (!points.roughly || !ring.mixed[r] || !sample_roughly(field, ring, r, i, s))
        s = sample_anew(field, to_field, points, at);
      const auto real = hn::FirstN(d, at < points.count() ? points.count() - at : 0);
      s.distance = hn::IfThenElse(real, s.distance, none);
      points.keep(at, s.distance);
      smallest = hn::Min(smallest, s.distance);
      // A whole vector is written in any case: a branch would be mispredicted too often.
      auto touching = hn::Lt(s.distance, points.limit_of(k, at));
      if (HWY_UNLIKELY(!ring.plain[r]) && limit > 0 && !hn::AllFalse(d, touching))
        touching = hn::Or(hn::Lt(s.distance, hn::Zero(d)),
                          hn::And(touching, in_bricks(field, to_field, points, at)));
      hn::StoreU(compress(di, points.row(at), hn::RebindMask(di, touching)), di,
                 reinterpret_cast<std::int32_t*>(out.row + written));
      hn::StoreU(compress(d, s.distance, touching), d, out.distance + written);
      hn::StoreU(compress(d, s.gx, touching), d, out.gx + written);
      hn::StoreU(compress(d, s.gy, touching), d, out.gy + written);
      hn::StoreU(compress(d, s.gz, touching), d, out.gz + written);
      written += hn::CountTrue(d, touching);
    }
    points.end(k, smallest);
    if (k + 2 * ahead < batches) points.prefetch(k + 2 * ahead);
    locate_at(k + ahead);
  }
  return written;
}

template <class M>
HWY_INLINE std::uint32_t bits_of(M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DF(), mask, bytes);
  return bytes[0] | bytes[1] << 8;
}

// Fills `look` for a group whose points are staged from `first` to `end`.
HWY_INLINE void learn_group(const Stage& stage, std::size_t first, std::size_t end, bool all,
                            const GroupLook& look, std::size_t k) {
  const DF d;
  const VF none = hn::Set(d, __builtin_huge_valf());
  const auto at = [&](std::size_t i) HWY_ATTR {
    return hn::IfThenElse(hn::FirstN(d, end - i), hn::LoadU(d, stage.distance + i), none);
  };
  VF least = none;
  for (std::size_t i = first; i < end; i += hn::Lanes(d)) least = hn::Min(least, at(i));
  least = hn::MinOfLanes(d, least);
  look.least[k] = hn::GetLane(least);
  if (!all) return;
  const VF edge = hn::Max(hn::Set(d, look.near), hn::Mul(hn::Set(d, kNearLeast), least));
  VF rest = none;
  std::uint32_t near_rows = 0;
  for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
    const VF v = at(i);
    const auto near = hn::Lt(v, edge);
    near_rows |= bits_of(near) << (i - first);
    rest = hn::Min(rest, hn::IfThenElse(near, none, v));
  }
  look.near_rows[k] = static_cast<std::uint16_t>(near_rows);
  look.rest[k] = hn::GetLane(hn::MinOfLanes(d, rest));
}

std::size_t touch_groups_simd(const FieldView& field, const Affine& to_field,
                              const PointsView& points, const std::uint32_t* groups,
                              std::size_t count, float limit, bool cold, const GroupLook& look,
                              const Touching& out) {
  if (look.rows == nullptr)
    return sample_batches(field, to_field,
                          WholeGroups{points, groups, limit, look.reach, look.least, look.roughly},
                          count, limit, cold, out, 0);
  std::size_t written = 0;
  Stage stage;
  for (std::size_t done = 0; done < count; done += kStaged) {
    const std::size_t some = HWY_MIN(kStaged, count - done);
    // The points of the next stage; at the start, of the first too.
    for (std::size_t k = done > 0 ? done + some : 0; k < HWY_MIN(done + some + kStaged, count); ++k)
      prefetch_group(points, groups[k]);
    stage_points(points, groups + done, look.rows + done, some, limit, look.reach, stage);
    const std::size_t staged = stage.first[some];
    written = sample_batches(field, to_field, StagedPoints{stage, staged},
                             (staged + kGroup - 1) / kGroup, limit, cold, out, written);
    for (std::size_t k = 0; k < some; ++k)
      learn_group(stage, stage.first[k], stage.first[k + 1], look.rows[done + k] == kAllRows, look,
                  done + k);
  }
  return written;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(touch_groups_simd);

std::size_t touch_groups(const FieldView& field, const Affine& to_field, const PointsView& points,
                         const std::uint32_t* groups, std::size_t count, float limit, bool cold,
                         const GroupLook& look, const Touching& out) {
  return HWY_DYNAMIC_DISPATCH(touch_groups_simd)(field, to_field, points, groups, count, limit,
                                                 cold, look, out);
}

}  // namespace h6::kernels
#endif
