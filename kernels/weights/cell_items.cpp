// SPDX-License-Identifier: Apache-2.0
// cell_items.cpp - the SIMD twin of cell_items_ref.cpp: a cell is a few vectors.
#include "kernels/weights/cell_items.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/cell_items.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/fold-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kCellMost>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());

// Finds where cells end, 64 rows at a time. The lengths of cells are random, so a loop over the
// rows of a cell is mispredicted, and a search that begins where the last one ended waits for it:
// with such a search frames of 1,000 to 16,000 contacts took 1.01 to 1.10 times as long
// (frame/clutter, frame/conforming and frame/loaded, AVX-512).
class Cells {
 public:
  HWY_INLINE explicit Cells(const CellContacts& c) : c_(c), here_(lasts(0)), next_(lasts(64)) {}

  // `begin` is the first row of a cell, and never less than in the last call. Returns how many rows
  // from there on are alone in their cells, up to a vector.
  HWY_INLINE std::size_t lone_from(std::size_t begin) {
    const auto ones = static_cast<std::size_t>(hwy::Num0BitsBelowLS1Bit_Nonzero64(~from(begin)));
    return HWY_MIN(ones, HWY_MIN(kLanes, c_.contacts.count - begin));
  }
  // The row behind the cell that begins there.
  HWY_INLINE std::size_t end_of(std::size_t begin) {
    const std::uint64_t ends = from(begin);
    HWY_DASSERT(ends != 0);  // else the cell has more than kCellMost rows
    return begin + 1 + hwy::Num0BitsBelowLS1Bit_Nonzero64(ends);
  }

 private:
  // Bit i < 63: row begin + i is the last of its cell. A cell has at most kCellMost rows, so some
  // of them are set. Bit 63 is 0.
  HWY_INLINE std::uint64_t from(std::size_t begin) {
    while (begin >= at_ + 64) at_ += 64, here_ = next_, next_ = lasts(at_ + 64);
    const std::size_t skip = begin - at_;
    return (here_ >> skip | next_ << 1 << (63 - skip)) & ~(std::uint64_t{1} << 63);
  }
  // Bit i: row `begin` + i is the last of its cell, or there is no such row.
  HWY_INLINE std::uint64_t lasts(std::size_t begin) const {
    const DF d;
    const hn::RebindToUnsigned<DF> du;
    const hn::RebindToSigned<DF> di;
    if (begin >= c_.contacts.count) return ~std::uint64_t{0};
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < 64; i += kLanes) {
      const std::size_t row = begin + i, behind = row + 1, count = c_.contacts.count;
      const std::size_t live = behind < count ? HWY_MIN(count - behind, kLanes) : 0;
      auto last = hn::Not(hn::FirstN(d, live));
      if (HWY_LIKELY(live == kLanes)) {
        const auto cell = hn::Ne(hn::LoadU(du, c_.cell + row), hn::LoadU(du, c_.cell + behind));
        const auto field = hn::Ne(hn::LoadU(di, c_.field + row), hn::LoadU(di, c_.field + behind));
        last = hn::Or(hn::RebindMask(d, cell), hn::RebindMask(d, field));
      } else if (live > 0) {
        const auto cell =
            hn::Ne(load_n(du, c_.cell + row, live), load_n(du, c_.cell + behind, live));
        const auto field =
            hn::Ne(load_n(di, c_.field + row, live), load_n(di, c_.field + behind, live));
        last = hn::Or(last, hn::Or(hn::RebindMask(d, cell), hn::RebindMask(d, field)));
      }
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(d, last, bytes);
      all |= std::uint64_t(bytes[0] | bytes[1] << 8) << i;
    }
    return all;
  }

  const CellContacts& c_;
  std::size_t at_ = 0;  // row of the first bit of here_
  std::uint64_t here_, next_;
};

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
  VF sum[8];  // directions, shares, nothing
  for (VF& s : sum) s = hn::Zero(d);
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    VF share = share_of(c, i, live);
    if (part != nullptr) share = hn::Mul(share, load_n(d, part + i, live));
    sum[6] = hn::Add(sum[6], share);
    for (int k = 0; k < 6; ++k)
      sum[k] = hn::MulAdd(share, read(column.k[k], i, c.contacts.count), sum[k]);
  }
  HWY_ALIGN float total[8] = {};
  add_four_sums(d, sum, total);
  add_four_sums(d, sum + 4, total + 4);
  if (!(total[6] > 0)) return 0;
  for (int k = 0; k < 6; ++k) mean[k] = total[k] / total[6];
  return total[6];
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

// Lists the contacts from i on with a share. Whole vectors are stored: the columns have room for a
// cell more than they need. Returns the item behind the last.
HWY_INLINE std::size_t list_some(const CellContacts& c, const Columns& column, std::size_t i,
                                 VF share, const CellItems& items, std::size_t count) {
  const DF d;
  const auto some = hn::Gt(share, hn::Zero(d));
  for (int k = 0; k < 6; ++k)
    hn::StoreU(compress(d, read(column.k[k], i, c.contacts.count), some), d,
               items.direction[k] + count);
  hn::StoreU(compress(d, share, some), d, items.share + count);
  return count + hn::CountTrue(d, some);
}

HWY_INLINE std::size_t list_alone(const CellContacts& c, const Columns& column, const float* part,
                                  std::size_t begin, std::size_t end, const CellItems& items,
                                  std::size_t count) {
  const DF d;
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    const VF rest = hn::Sub(hn::Set(d, 1.0f), load_n(d, part + i, live));
    count = list_some(c, column, i, hn::Mul(rest, share_of(c, i, live)), items, count);
  }
  return count;
}

std::size_t list_simd(const CellContacts& c, const GaussWidths& widths, const CellItems& items,
                      float* part) {
  const Columns column(c.contacts);
  const float per_square[2] = {1 / (widths.normal * widths.normal),
                               1 / (widths.torque * widths.torque)};
  Cells cells(c);
  std::size_t count = 0;
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    if (const std::size_t lone = cells.lone_from(begin)) {
      end = begin + lone;
      store_n(hn::Set(DF(), 1.0f), DF(), part + begin, lone);
      count = list_some(c, column, begin, share_of(c, begin, lone), items, count);
      continue;
    }
    end = cells.end_of(begin);
    float mean[6];
    float share = mean_of(c, column, nullptr, begin, end, mean);
    if (!(share > 0)) {
      std::fill(part + begin, part + end, 1.0f);
      continue;
    }
    const bool whole = fill_part(column, c.contacts.count, per_square, mean, begin, end, part);
    if (!whole) share = mean_of(c, column, part, begin, end, mean);
    for (int k = 0; k < 6; ++k) items.direction[k][count] = mean[k];
    items.share[count] = share;
    count += share > 0;
    if (!whole) count = list_alone(c, column, part, begin, end, items, count);
  }
  return count;
}

// The densities of contacts that are parts of a cell's item and items of their own; `at`: the first
// of these. Returns the item behind the last.
HWY_INLINE std::size_t weigh_parts(const CellContacts& c, const float* part, std::size_t begin,
                                   std::size_t end, float of_cell, const float* item_share,
                                   const float* item_weight, std::size_t at, float* weight) {
  for (std::size_t i = begin; i < end; ++i) {
    const float share = c.contacts.facing[i] * c.contacts.depth[i];
    const bool stands_alone = (1 - part[i]) * share > 0;
    const float alone = stands_alone ? item_share[at] / item_weight[at] : 0;
    at += stands_alone;
    weight[i] =
        share > 0 ? c.contacts.facing[i] * share / (part[i] * of_cell + (1 - part[i]) * alone) : 0;
  }
  return at;
}

// Contacts that are alone in their cells, up to a vector of them; `at`: the first one's item.
// Returns the item behind the last.
HWY_INLINE std::size_t weigh_lone(const CellContacts& c, std::size_t begin, std::size_t end,
                                  const float* item_share, const float* item_weight, std::size_t at,
                                  float* weight) {
  const DF d;
  const std::size_t live = end - begin;
  const VF share = share_of(c, begin, live);
  if (HWY_LIKELY(hn::CountTrue(d, hn::Gt(share, hn::Zero(d))) == live)) {
    const VF per = hn::Div(load_n(d, item_weight + at, live), load_n(d, item_share + at, live));
    const VF facing = read(c.contacts.facing, begin, c.contacts.count);
    store_n(hn::Mul(hn::Mul(facing, share), per), d, weight + begin, live);
    return at + live;
  }
  for (std::size_t i = begin; i < end; ++i) {
    const float facing = c.contacts.facing[i], own = facing * c.contacts.depth[i];
    weight[i] = own > 0 ? facing * own * item_weight[at] / item_share[at] : 0;
    at += own > 0;
  }
  return at;
}

void weigh_simd(const CellContacts& c, const float* part, const float* item_share,
                const float* item_weight, float* weight) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  Cells cells(c);
  std::size_t at = 0;
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    if (const std::size_t lone = cells.lone_from(begin)) {
      end = begin + lone;
      at = weigh_lone(c, begin, end, item_share, item_weight, at, weight);
      continue;
    }
    end = cells.end_of(begin);
    auto joined = hn::FirstN(d, 0), parted = joined;
    for (std::size_t i = begin; i < end; i += kLanes) {
      const std::size_t live = end - i;
      const VF share = share_of(c, i, live), p = read(part, i, c.contacts.count);
      joined = hn::Or(joined, hn::Gt(hn::Mul(p, share), zero));
      parted = hn::Or(parted, hn::Gt(hn::Mul(hn::Sub(one, p), share), zero));
    }
    const bool has_item = !hn::AllFalse(d, joined);
    const float of_cell = has_item ? item_share[at] / item_weight[at] : 0;
    at += has_item;
    if (HWY_UNLIKELY(!hn::AllFalse(d, parted))) {
      at = weigh_parts(c, part, begin, end, of_cell, item_share, item_weight, at, weight);
      continue;
    }
    const VF per = hn::Set(d, has_item ? 1 / of_cell : 0);
    for (std::size_t i = begin; i < end; i += kLanes) {
      const std::size_t live = end - i;
      const VF facing = read(c.contacts.facing, i, c.contacts.count);
      store_n(hn::Mul(hn::Mul(facing, per), share_of(c, i, live)), d, weight + i, live);
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
