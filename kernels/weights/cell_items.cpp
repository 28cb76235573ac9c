// SPDX-License-Identifier: Apache-2.0
// cell_items.cpp - the SIMD twin of cell_items_ref.cpp: a cell is a few vectors.
#include "kernels/weights/cell_items.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/cell_items.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kCellMost>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());

HWY_INLINE std::size_t end_of(const CellContacts& c, std::size_t begin) {
  std::size_t i = begin + 1;
  while (i < c.contacts.count && c.cell[i] == c.cell[begin] && c.field[i] == c.field[begin]) ++i;
  return i;
}

struct Columns {
  const float* k[6];
  HWY_INLINE explicit Columns(const DirectionsView& v) : k{v.nx, v.ny, v.nz, v.tx, v.ty, v.tz} {}
};

// Reads whole vectors where the columns reach so far: masks cost more than a cell's few rows. Lanes
// past the cell then hold rows of the next ones.
HWY_INLINE VF read(const float* column, std::size_t i, std::size_t count) {
  const DF d;
  if (HWY_LIKELY(i + kLanes <= count)) return hn::LoadU(d, column + i);
  return load_n(d, column + i, count - i);
}

// Lanes past the cell are 0.
HWY_INLINE VF share_of(const CellContacts& c, std::size_t i, std::size_t live) {
  const DF d;
  const std::size_t count = c.contacts.count;
  return hn::IfThenElseZero(hn::FirstN(d, live), hn::Mul(read(c.contacts.facing, i, count),
                                                         read(c.contacts.depth, i, count)));
}

// The mean direction of a cell; `part` (may be null) scales the shares. Returns the sum of shares.
HWY_INLINE float mean_of(const CellContacts& c, const Columns& column, const float* part,
                         std::size_t begin, std::size_t end, float mean[6]) {
  const DF d;
  VF sum[6], all = hn::Zero(d);
  for (VF& s : sum) s = hn::Zero(d);
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    VF share = share_of(c, i, live);
    if (part != nullptr) share = hn::Mul(share, load_n(d, part + i, live));
    all = hn::Add(all, share);
    for (int k = 0; k < 6; ++k)
      sum[k] = hn::MulAdd(share, read(column.k[k], i, c.contacts.count), sum[k]);
  }
  const float total = hn::GetLane(hn::SumOfLanes(d, all));
  if (!(total > 0)) return 0;
  for (int k = 0; k < 6; ++k) mean[k] = hn::GetLane(hn::SumOfLanes(d, sum[k])) / total;
  return total;
}

// Returns whether all contacts belong to the cell wholly.
HWY_INLINE bool fill_part(const Columns& column, std::size_t count, const float per_square[2],
                          const float mean[6], std::size_t begin, std::size_t end, float* part) {
  const DF d;
  const VF unlike = hn::Set(d, kUnlike), scale = hn::Set(d, 1 / (kUnlike - kAlike));
  bool whole = true;
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    VF x = hn::Zero(d);
    for (int s = 0; s < 2; ++s) {
      VF away = hn::Zero(d);
      for (int k = 3 * s; k < 3 * s + 3; ++k) {
        const VF gap = hn::Sub(read(column.k[k], i, count), hn::Set(d, mean[k]));
        away = hn::MulAdd(gap, gap, away);
      }
      x = hn::MulAdd(away, hn::Set(d, per_square[s]), x);
    }
    const VF one = hn::Set(d, 1.0f);
    const VF p = hn::Min(hn::Max(hn::Mul(hn::Sub(unlike, x), scale), hn::Zero(d)), one);
    whole = whole && hn::AllTrue(d, hn::Or(hn::Eq(p, one), hn::Not(hn::FirstN(d, live))));
    store_n(p, d, part + i, live);
  }
  return whole;
}

HWY_INLINE std::size_t list_alone(const CellContacts& c, const Columns& column, const float* part,
                                  std::size_t begin, std::size_t end, const CellItems& items,
                                  std::size_t count) {
  const DF d;
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    const VF rest = hn::Sub(hn::Set(d, 1.0f), load_n(d, part + i, live));
    const VF alone = hn::Mul(rest, share_of(c, i, live));
    const auto some = hn::Gt(alone, hn::Zero(d));
    // Whole vectors are stored: the columns have room for a cell more than they need.
    for (int k = 0; k < 6; ++k)
      hn::StoreU(compress(d, load_n(d, column.k[k] + i, live), some), d,
                 items.direction[k] + count);
    hn::StoreU(compress(d, alone, some), d, items.share + count);
    count += hn::CountTrue(d, some);
  }
  return count;
}

std::size_t list_simd(const CellContacts& c, const GaussWidths& widths, const CellItems& items,
                      float* part) {
  const Columns column(c.contacts);
  const float per_square[2] = {1 / (widths.normal * widths.normal),
                               1 / (widths.torque * widths.torque)};
  std::size_t count = 0;
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    end = end_of(c, begin);
    float mean[6];
    float share = mean_of(c, column, nullptr, begin, end, mean);
    for (std::size_t i = begin; i < end; ++i) part[i] = 1;
    if (!(share > 0)) continue;
    const bool whole =
        end - begin == 1 || fill_part(column, c.contacts.count, per_square, mean, begin, end, part);
    if (!whole) share = mean_of(c, column, part, begin, end, mean);
    if (share > 0) {
      for (int k = 0; k < 6; ++k) items.direction[k][count] = mean[k];
      items.share[count++] = share;
    }
    if (!whole) count = list_alone(c, column, part, begin, end, items, count);
  }
  return count;
}

void weigh_simd(const CellContacts& c, const float* part, const float* item_share,
                const float* item_weight, float* weight) {
  const DF d;
  std::size_t at = 0;
  const auto density = [&] {
    const float phi = item_share[at] / item_weight[at];
    ++at;
    return phi;
  };
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    end = end_of(c, begin);
    bool joined = false, whole = true;
    for (std::size_t i = begin; i < end; i += kLanes) {
      const std::size_t live = end - i;
      const VF share = share_of(c, i, live), p = load_n(d, part + i, live);
      joined = joined || !hn::AllFalse(d, hn::Gt(hn::Mul(p, share), hn::Zero(d)));
      whole = whole &&
              hn::AllFalse(d, hn::Gt(hn::Mul(hn::Sub(hn::Set(d, 1.0f), p), share), hn::Zero(d)));
    }
    const float of_cell = joined ? density() : 0;
    if (whole) {
      const VF per = hn::Set(d, joined ? 1 / of_cell : 0);
      for (std::size_t i = begin; i < end; i += kLanes) {
        const std::size_t live = end - i;
        const VF w =
            hn::Mul(hn::Mul(load_n(d, c.contacts.facing + i, live), per), share_of(c, i, live));
        store_n(w, d, weight + i, live);
      }
      continue;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const float share = c.contacts.facing[i] * c.contacts.depth[i];
      const float alone = (1 - part[i]) * share > 0 ? density() : 0;
      weight[i] = share > 0
                      ? c.contacts.facing[i] * share / (part[i] * of_cell + (1 - part[i]) * alone)
                      : 0;
    }
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(list_simd);
HWY_EXPORT(weigh_simd);

std::size_t list_cell_items(const CellContacts& c, const GaussWidths& widths,
                            const CellItems& items, float* part) {
  return HWY_DYNAMIC_DISPATCH(list_simd)(c, widths, items, part);
}
void weigh_by_items(const CellContacts& c, const float* part, const float* item_share,
                    const float* item_weight, float* weight) {
  HWY_DYNAMIC_DISPATCH(weigh_simd)(c, part, item_share, item_weight, weight);
}

}  // namespace h6::kernels
#endif
