// SPDX-License-Identifier: Apache-2.0
// cell_items.cpp - the SIMD twin of cell_items_ref.cpp.
//
// The lengths of cells are random, so the processor mispredicts a loop over the rows of a cell.
// Here no branch depends on them. Blocks of whole cells are weighted and turned into rows, whose
// components are the lanes of a vector. A running sum over the rows starts anew where a cell
// begins, and its value at the end of a cell is carried back to all rows of it. Each row writes its
// items, and the next one overwrites them if they count for nothing. With a loop over cells, frames
// of 1,000 contacts took 1.03 to 1.04 times as long, of 93 1.08 to 1.13 times (frame/clutter,
// frame/conforming, frame/many; AVX2), of 16,000 on a plane, where cells are long, 0.98 times.
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

using DF = hn::CappedTag<float, 8>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kBlock = 64;  // rows at most

// A row is s N, s T, s and nothing.
constexpr std::size_t kRowParts = 8 / kLanes;
using Row = VF[kRowParts];
template <std::size_t kRows>
using Rows = float[kRows][8];

HWY_INLINE void load_row(const float* row, Row& to) {
  HWY_UNROLL(8)
  for (std::size_t k = 0; k < kRowParts; ++k) to[k] = hn::Load(DF(), row + k * kLanes);
}
HWY_INLINE void store_row(const Row& row, float* to) {
  HWY_UNROLL(8)
  for (std::size_t k = 0; k < kRowParts; ++k) hn::Store(row[k], DF(), to + k * kLanes);
}

#if HWY_TARGET != HWY_SCALAR
// Turns four rows of four lanes into columns, in each block of four lanes by itself.
HWY_INLINE void transpose_four(VF* v) {
  const DF d;
  const hn::Repartition<double, DF> pairs;
  const auto join = [&](VF a, VF b, VF& low, VF& high) HWY_ATTR {
    const auto x = hn::BitCast(pairs, a), y = hn::BitCast(pairs, b);
    low = hn::BitCast(d, hn::InterleaveLower(pairs, x, y));
    high = hn::BitCast(d, hn::InterleaveUpper(pairs, x, y));
  };
  const VF a = hn::InterleaveLower(d, v[0], v[1]), b = hn::InterleaveUpper(d, v[0], v[1]);
  const VF c = hn::InterleaveLower(d, v[2], v[3]), e = hn::InterleaveUpper(d, v[2], v[3]);
  join(a, c, v[0], v[1]);
  join(b, e, v[2], v[3]);
}
#endif

// Stores eight columns of kLanes rows as rows.
HWY_INLINE void store_columns(VF (&v)[8], float (*rows)[8]) {
  const DF d;
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < 8; ++k) hn::Store(v[k], d, rows[0] + k);
#else
  transpose_four(v), transpose_four(v + 4);
  HWY_UNROLL(4)
  for (int r = 0; r < 4; ++r) {
    if constexpr (kLanes == 4) {
      hn::Store(v[r], d, rows[r]), hn::Store(v[r + 4], d, rows[r] + 4);
    } else {
      hn::Store(hn::ConcatLowerLower(d, v[r + 4], v[r]), d, rows[r]);
      hn::Store(hn::ConcatUpperUpper(d, v[r + 4], v[r]), d, rows[r + 4]);
    }
  }
#endif
}
HWY_INLINE void load_columns(const float (*rows)[8], VF (&v)[8]) {
  const DF d;
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < 8; ++k) v[k] = hn::Load(d, rows[0] + k);
#else
  HWY_UNROLL(4)
  for (int r = 0; r < 4; ++r) {
    if constexpr (kLanes == 4) {
      v[r] = hn::Load(d, rows[r]), v[r + 4] = hn::Load(d, rows[r] + 4);
    } else {
      const VF a = hn::Load(d, rows[r]), b = hn::Load(d, rows[r + 4]);
      v[r] = hn::ConcatLowerLower(d, b, a), v[r + 4] = hn::ConcatUpperUpper(d, b, a);
    }
  }
  transpose_four(v), transpose_four(v + 4);
#endif
}

struct Block {
  std::size_t begin, count;         // contacts
  std::uint64_t last;               // bit i: contact begin + i is the last one of its cell
  HWY_ALIGN Rows<kBlock> weighted;  // of contacts, s their share
  HWY_ALIGN Rows<kBlock> sum;       // of their cells
  HWY_ALIGN Rows<2 * kBlock> item;
  HWY_ALIGN float open[kBlock];  // all bits set where the contact is not the last of its cell
  HWY_ALIGN float part[kBlock];
  std::uint64_t joined;  // bit i: contact i has a share in its cell's item
  std::uint64_t alone;   // bit i: it has an item of its own
};

struct Columns {
  const float* k[6];
  HWY_INLINE explicit Columns(const DirectionsView& v) : k{v.nx, v.ny, v.nz, v.tx, v.ty, v.tz} {}
};

HWY_INLINE std::uint64_t bits_from(hn::Mask<DF> mask, std::size_t row) {
  return std::uint64_t{bits_of(DF(), mask)} << row;
}

// Returns the lowest `count` bits, from 1 to 64.
HWY_INLINE std::uint64_t first_bits(std::size_t count) { return ~std::uint64_t{0} >> (64 - count); }

// Finds the cells from `begin` on that fit into a block; a cell has at most kCellMost rows.
HWY_INLINE void find_cells(const CellContacts& c, std::size_t begin, Block& b) {
  const DF d;
  const hn::RebindToUnsigned<DF> du;
  const hn::RebindToSigned<DF> di;
  const std::size_t rows = HWY_MIN(c.contacts.count - begin, kBlock);
  b.begin = begin, b.last = 0;
  for (std::size_t i = 0; i < rows; i += kLanes) {
    const std::size_t row = begin + i, behind = c.contacts.count - row - 1;
    const auto cell =
        hn::Eq(load_n(du, c.cell + row, behind + 1), load_n(du, c.cell + row + 1, behind));
    const auto field =
        hn::Eq(load_n(di, c.field + row, behind + 1), load_n(di, c.field + row + 1, behind));
    const auto open =
        hn::And(hn::FirstN(d, behind), hn::And(hn::RebindMask(d, cell), hn::RebindMask(d, field)));
    hn::Store(hn::VecFromMask(d, open), d, b.open + i);
    b.last |= bits_from(hn::Not(open), i);
  }
  HWY_DASSERT(b.last != 0);  // else a cell has more than kCellMost rows
  if (rows == kBlock)
    b.count = kBlock - hwy::Num0BitsAboveMS1Bit_Nonzero64(b.last);
  else
    b.count = rows;
}

HWY_INLINE VF share_of(const CellContacts& c, std::size_t i, std::size_t live) {
  return hn::Mul(load_n(DF(), c.contacts.facing + i, live),
                 load_n(DF(), c.contacts.depth + i, live));
}

HWY_INLINE void clear(Row& row) {
  HWY_UNROLL(8)
  for (std::size_t k = 0; k < kRowParts; ++k) row[k] = hn::Zero(DF());
}

// Weighs the contacts, and adds them up from the first of each cell on.
HWY_INLINE void add_up(const CellContacts& c, const Columns& column, Block& b) {
  const DF d;
  const std::size_t count = b.count;
  Row sum;
  clear(sum);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const std::size_t row = b.begin + i, live = c.contacts.count - row;
    VF v[8];
    v[6] = share_of(c, row, live);
    v[7] = hn::Zero(d);
    HWY_UNROLL(6)
    for (int k = 0; k < 6; ++k) v[k] = hn::Mul(v[6], load_n(d, column.k[k] + row, live));
    store_columns(v, b.weighted + i);
    HWY_UNROLL(8)
    for (std::size_t r = i; r < i + kLanes; ++r) {
      Row one;
      load_row(b.weighted[r], one);
      const VF open = hn::Set(d, b.open[r]);
      HWY_UNROLL(8)
      for (std::size_t k = 0; k < kRowParts; ++k) {
        sum[k] = hn::Add(sum[k], one[k]);
        hn::Store(sum[k], d, b.sum[r] + k * kLanes);
        sum[k] = hn::And(sum[k], open);
      }
    }
  }
}

// Gives all contacts of a cell the sum at its last one.
HWY_INLINE void carry_back(Block& b) {
  const DF d;
  Row sum;
  clear(sum);
  for (std::size_t i = b.count; i-- > 0;) {
    const auto open = hn::MaskFromVec(hn::Set(d, b.open[i]));
    Row row;
    load_row(b.sum[i], row);
    HWY_UNROLL(8)
    for (std::size_t k = 0; k < kRowParts; ++k) sum[k] = hn::IfThenElse(open, sum[k], row[k]);
    store_row(sum, b.sum[i]);
  }
}

// Returns whether all contacts belong to their cells wholly.
HWY_INLINE bool fill_parts(const CellContacts& c, const Columns& column, const float per_square[2],
                           float* part, Block& b) {
  const DF d;
  const VF unlike = hn::Set(d, kUnlike), scale = hn::Set(d, 1 / (kUnlike - kAlike));
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  std::uint64_t parted = 0, joined = 0, alone = 0;
  for (std::size_t i = 0; i < b.count; i += kLanes) {
    const std::size_t row = b.begin + i, live = c.contacts.count - row;
    VF sum[8];
    load_columns(b.sum + i, sum);
    const VF per = hn::Div(one, sum[6]);
    VF x = zero;
    HWY_UNROLL(2)
    for (int s = 0; s < 2; ++s) {
      VF away = zero;
      HWY_UNROLL(3)
      for (int k = 3 * s; k < 3 * s + 3; ++k) {
        const VF gap = hn::NegMulAdd(sum[k], per, load_n(d, column.k[k] + row, live));
        away = hn::MulAdd(gap, gap, away);
      }
      x = hn::MulAdd(away, hn::Set(d, per_square[s]), x);
    }
    VF p = hn::Min(hn::Max(hn::Mul(hn::Sub(unlike, x), scale), zero), one);
    const auto some = hn::Gt(sum[6], zero);
    p = hn::IfThenElse(some, p, one);
    hn::Store(p, d, b.part + i);
    store_n(p, d, part + row, b.count - i);
    const VF share = share_of(c, row, live);
    parted |= bits_from(hn::Ne(p, one), i);
    joined |= bits_from(hn::And(some, hn::Gt(hn::Mul(p, share), zero)), i);
    alone |= bits_from(hn::Gt(hn::Mul(hn::Sub(one, p), share), zero), i);
  }
  b.joined = joined, b.alone = alone;
  return (parted & first_bits(b.count)) == 0;
}

// Calls run(last, rows) for every cell of a block: its last contact, and the bits of all.
template <class Run>
HWY_INLINE void for_cells(const Block& b, const Run& run) {
  std::uint64_t done = 0;
  for (std::uint64_t ends = b.last & first_bits(b.count); ends != 0; ends &= ends - 1) {
    const std::uint64_t rows = (ends ^ (ends - 1)) & ~done;
    run(hwy::Num0BitsBelowLS1Bit_Nonzero64(ends), rows);
    done |= rows;
  }
}

// Holds the number of an item for each contact of a block. A cell is filled in whole vectors, which
// the next one overwrites.
struct Filled {
  HWY_ALIGN std::int32_t at[kBlock + kCellMost];
  HWY_INLINE void fill(std::uint64_t rows, std::int32_t item) {
    const hn::RebindToSigned<DF> di;
    const std::size_t begin = hwy::Num0BitsBelowLS1Bit_Nonzero64(rows);
    HWY_DASSERT(rows >> begin < std::uint64_t{1} << kCellMost);
    HWY_UNROLL(4)
    for (std::size_t k = 0; k < kCellMost; k += kLanes)
      hn::StoreU(hn::Set(di, item), di, at + begin + k);
  }
  HWY_INLINE void copy(std::size_t count, std::int32_t* to) const {
    const hn::RebindToSigned<DF> di;
    for (std::size_t i = 0; i < count; i += kLanes)
      store_n(hn::Load(di, at + i), di, to + i, count - i);
  }
};

// Lists the items of a block in which all contacts belong to their cells wholly. `first`: the
// number of items before. Returns how many there are.
HWY_INLINE std::size_t list_cells(std::int32_t first, const ItemsOfContacts& of, Block& b) {
  Filled cell;
  std::size_t count = 0;
  for_cells(b, [&](std::size_t last, std::uint64_t rows) HWY_ATTR {
    Row sum;
    load_row(b.sum[last], sum);
    store_row(sum, b.item[count]);
    cell.fill(rows, first + static_cast<std::int32_t>(count));
    count += (b.joined & rows) != 0;
  });
  cell.copy(b.count, of.cell + b.begin);
  cell.copy(b.count, of.own + b.begin);
  return count;
}

// Lists the items of any block in the same way.
HWY_INLINE std::size_t list_parts(std::int32_t first, const ItemsOfContacts& of, Block& b) {
  const DF d;
  std::int32_t* const own = of.own + b.begin;
  std::uint64_t last = b.last, joined = b.joined, alone = b.alone, any = 0;
  std::size_t count = 0;
  const auto next = [&] { return first + static_cast<std::int32_t>(count); };
  std::int32_t at_end[kBlock];
  Row sum;
  clear(sum);
  for (std::size_t i = 0, rows = b.count; i < rows; ++i) {
    const VF part = hn::Set(d, b.part[i]), open = hn::Set(d, b.open[i]);
    const VF rest_part = hn::Sub(hn::Set(d, 1.0f), part);
    Row row, rest;
    load_row(b.weighted[i], row);
    HWY_UNROLL(8)
    for (std::size_t k = 0; k < kRowParts; ++k) {
      rest[k] = hn::Mul(rest_part, row[k]);
      sum[k] = hn::Add(sum[k], hn::Mul(part, row[k]));
    }
    store_row(rest, b.item[count]);
    own[i] = next();
    count += alone & 1;
    store_row(sum, b.item[count]);
    at_end[i] = next();
    any |= joined;
    count += last & any & 1;
    any &= (last & 1) - 1;
    last >>= 1, joined >>= 1, alone >>= 1;
    HWY_UNROLL(8)
    for (std::size_t k = 0; k < kRowParts; ++k) sum[k] = hn::And(sum[k], open);
  }
  Filled cell;
  for_cells(b, [&](std::size_t end, std::uint64_t rows) HWY_ATTR { cell.fill(rows, at_end[end]); });
  cell.copy(b.count, of.cell + b.begin);
  return count;
}

// Divides the rows of items by their shares. Whole vectors are stored: the columns have room for a
// cell more than they need.
HWY_INLINE void put_items(Block& b, std::size_t count, const CellItems& items, std::size_t to) {
  const DF d;
  for (std::size_t i = 0; i < count; i += kLanes) {
    VF v[8];
    load_columns(b.item + i, v);
    const VF per = hn::Div(hn::Set(d, 1.0f), v[6]);
    for (int k = 0; k < 6; ++k) hn::StoreU(hn::Mul(v[k], per), d, items.direction[k] + to + i);
    hn::StoreU(v[6], d, items.share + to + i);
  }
}

std::size_t list_simd(const CellContacts& c, const GaussWidths& widths, const CellItems& items,
                      const ItemsOfContacts& of) {
  const Columns column(c.contacts);
  const float per_square[2] = {1 / (widths.normal * widths.normal),
                               1 / (widths.torque * widths.torque)};
  std::size_t count = 0;
  Block b;
  for (std::size_t begin = 0; begin < c.contacts.count; begin += b.count) {
    find_cells(c, begin, b);
    add_up(c, column, b);
    carry_back(b);
    const auto first = static_cast<std::int32_t>(count);
    const std::size_t some = fill_parts(c, column, per_square, of.part, b)
                                 ? list_cells(first, of, b)
                                 : list_parts(first, of, b);
    put_items(b, some, items, count);
    count += some;
  }
  return count;
}

void weigh_simd(const CellContacts& c, const ItemsOfContacts& of, const float* item_share,
                const float* item_weight, float* weight) {
  const DF d;
  const hn::RebindToSigned<DF> di;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const auto density = [&](const std::int32_t* item, std::size_t live) HWY_ATTR {
    const auto at = load_n(di, item, live);
    return hn::Div(hn::GatherIndex(d, item_share, at), hn::GatherIndex(d, item_weight, at));
  };
  for (std::size_t i = 0; i < c.contacts.count; i += kLanes) {
    const std::size_t live = c.contacts.count - i;
    const VF facing = load_n(d, c.contacts.facing + i, live), share = share_of(c, i, live);
    const VF part = load_n(d, of.part + i, live);
    VF phi = hn::IfThenElseZero(hn::Gt(part, zero), hn::Mul(part, density(of.cell + i, live)));
    const auto parted = hn::Lt(part, one);
    if (!hn::AllFalse(d, parted))
      phi = hn::Add(
          phi, hn::IfThenElseZero(parted, hn::Mul(hn::Sub(one, part), density(of.own + i, live))));
    const VF w = hn::Div(hn::Mul(facing, share), phi);
    store_n(hn::IfThenElseZero(hn::Gt(share, zero), w), d, weight + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(list_simd);
HWY_EXPORT(weigh_simd);

std::size_t list_cell_items(const CellContacts& c, const GaussWidths& widths,
                            const CellItems& items, const ItemsOfContacts& of) {
  return HWY_DYNAMIC_DISPATCH(list_simd)(c, widths, items, of);
}
void weigh_by_items(const CellContacts& c, const ItemsOfContacts& of, const float* item_share,
                    const float* item_weight, float* weight) {
  HWY_DYNAMIC_DISPATCH(weigh_simd)(c, of, item_share, item_weight, weight);
}

}  // namespace h6::kernels
#endif
