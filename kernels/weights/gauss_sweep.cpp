// SPDX-License-Identifier: Apache-2.0
// gauss_sweep.cpp - the stages, pairs and weights of gauss_sweep.h.
#include "kernels/weights/gauss_sweep.h"

#include <algorithm>

#include "kernels/weights/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_sweep.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/fold-inl.h"
#include "kernels/tail-inl.h"
#include "kernels/weights/geodesic-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kBandBlock>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kRows = 4;  // a group: rows that share loads of columns

// The number of rows whose hats a column sums before it adds them to the total. Rounding then grows
// with the number of such sums, not with the number of contacts.
constexpr std::size_t kFresh = 128;
constexpr std::uint32_t kRun = 64 * kLanes;  // the same for a row's sum over columns

// A coordinate beyond the reach of any hat; its square does not overflow a float.
constexpr float kNowhere = 1e15f;

// Fills the columns in the order of the bands, with padding. With gather instructions the sweep of
// 1,000 contacts took 1.10 times as long by AVX2, 0.97 by AVX-512
// (kernels/gauss_sweep/robust/walls).
void gather_rows(const GaussSweep& sweep) {
  const DirectionsView& c = sweep.contacts;
  const GaussPairs& pairs = *sweep.product;
  const std::uint32_t* const source = sweep.bands[0].source;
  const std::size_t rows = band_blocks(c.count) * kBandBlock;
  for (int k = 0; k < 6; ++k) {
    const float* const from = pairs.column[k];
    float* const to = pairs.at[k];
    for (std::size_t i = 0; i < c.count; ++i) to[i] = from[source[i]];
    std::fill(to + c.count, to + rows, kNowhere);
  }
  std::fill_n(pairs.share, c.count, *sweep.per_share);
  for (const float* from : {c.depth, c.facing})
    for (std::size_t i = 0; from != nullptr && i < c.count; ++i) pairs.share[i] *= from[source[i]];
  std::fill(pairs.share + c.count, pairs.share + rows, 0.0f);
}

// Finds the boxes of the blocks. They are wider than their contacts by more than a distance rounds.
void find_boxes(const GaussSweep& sweep) {
  const DF d;
  const GaussPairs& pairs = *sweep.product;
  const std::size_t count = sweep.contacts.count, blocks = band_blocks(count);
  for (int k = 0; k < 6; ++k) {
    const float* const at = pairs.at[k];
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::size_t begin = b * kBandBlock, end = HWY_MIN(begin + kBandBlock, count);
      VF low = hn::Set(d, at[begin]), high = low;
      for (std::size_t i = begin; i < end; i += kLanes) {
        const VF v = hn::IfThenElse(hn::FirstN(d, end - i), hn::Load(d, at + i), low);
        low = hn::Min(low, v), high = hn::Max(high, v);
      }
      const float least = hn::GetLane(hn::MinOfLanes(d, low)),
                  most = hn::GetLane(hn::MaxOfLanes(d, high));
      pairs.centre[k][b] = 0.5f * (least + most);
      pairs.half[k][b] = 0.5f * (most - least) + 1e-6f * HWY_MAX(-least, most);
    }
    for (std::size_t b = blocks; b < blocks + kBandBlock; ++b)
      pairs.centre[k][b] = kNowhere, pairs.half[k][b] = 0;
  }
}

// ---- pairs

// Rows i .. i + kRows - 1.
struct Group {
  VF at[kRows][3], share[kRows], sum[kRows];
};

template <bool kMasked, bool kGeodesic>
HWY_INLINE void add_tile(const GaussPairs& g, const VF* width2, std::size_t i, std::size_t j,
                         float* column, Group& rows) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF x[6], hat[kRows];
  for (int k = 0; k < 3; ++k) x[k] = hn::Load(d, g.at[k] + j);
  const auto gap_to_edge = [&](std::size_t r, int s) HWY_ATTR {
    VF v = width2[s];
    HWY_UNROLL(3)
    for (int k = 3 * s; k < 3 * s + 3; ++k) {
      // Registers hold the first sphere; the second is broadcast from memory.
      const VF at = s == 0 ? rows.at[r][k] : hn::Set(d, g.at[k][i + r]);
      const VF gap = hn::Sub(x[k], at);
      v = hn::NegMulAdd(gap, gap, v);
    }
    if constexpr (kGeodesic) return geodesic_hat(d, width2[s], v);
    return hn::Max(v, zero);
  };
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kRows; ++r) {
    hat[r] = gap_to_edge(r, 0);
    if (kMasked) {
      // Only columns behind the row.
      const std::size_t out = i + r + 1 > j ? i + r + 1 - j : 0;
      hat[r] = hn::IfThenZeroElse(hn::FirstN(d, out), hat[r]);
    }
  }
  const VF any = hn::Max(hn::Max(hat[0], hat[1]), hn::Max(hat[2], hat[3]));
  if (hn::AllTrue(d, hn::Eq(any, zero))) return;
  for (int k = 3; k < 6; ++k) x[k] = hn::Load(d, g.at[k] + j);
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kRows; ++r) hat[r] = hn::Mul(hat[r], gap_to_edge(r, 1));
  const VF share = hn::Load(d, g.share + j);
  VF sum = hn::Load(d, column + j);
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kRows; ++r) {
    rows.sum[r] = hn::MulAdd(share, hat[r], rows.sum[r]);
    sum = hn::MulAdd(rows.share[r], hat[r], sum);
  }
  hn::Store(sum, d, column + j);
}

// Bit k: block first + k, of at most 64 up to `end`, may have contacts near those of block b.
HWY_INLINE std::uint64_t near_blocks(const GaussPairs& g, const VF* width2, std::size_t b,
                                     std::size_t first, std::size_t end) {
  const DF d;
  const VF more = hn::Set(d, 1 + 1e-5f);
  std::uint64_t near = 0;
  for (std::size_t j = first; j < end; j += kLanes) {
    auto both = hn::FirstN(d, end - j);
    for (int s = 0; s < 2; ++s) {
      VF gap2 = hn::Zero(d);
      for (int k = 3 * s; k < 3 * s + 3; ++k) {
        const VF apart =
            hn::Abs(hn::Sub(hn::LoadU(d, g.centre[k] + j), hn::Set(d, g.centre[k][b])));
        const VF wide = hn::Add(hn::LoadU(d, g.half[k] + j), hn::Set(d, g.half[k][b]));
        const VF gap = hn::Max(hn::Sub(apart, wide), hn::Zero(d));
        gap2 = hn::MulAdd(gap, gap, gap2);
      }
      both = hn::And(both, hn::Le(gap2, hn::Mul(width2[s], more)));
    }
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, both, bits);
    near |= (bits[0] | std::uint64_t{bits[1]} << 8) << (j - first);
  }
  return near;
}

// Adds the pairs of a group's rows from `i` on with columns `from` to `end` of the near blocks, of
// which bit 0 is the one that holds `from`.
template <bool kGeodesic>
HWY_INLINE void add_group(const GaussPairs& g, const VF* width2, std::uint64_t near, std::size_t i,
                          std::size_t from, std::size_t end, float* fresh, float* total) {
  const DF d;
  Group rows;
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kRows; ++r) {
    for (int k = 0; k < 3; ++k) rows.at[r][k] = hn::Set(d, g.at[k][i + r]);
    rows.share[r] = hn::Set(d, g.share[i + r]);
    rows.sum[r] = hn::Zero(d);
  }
  const std::size_t behind = i / kLanes * kLanes;
  std::size_t block = from / kBandBlock;
  while (near != 0) {
    // Blocks that follow each other are one range.
    const std::size_t skip = hwy::Num0BitsBelowLS1Bit_Nonzero64(near);
    near >>= skip, block += skip;
    const std::size_t more = ~near == 0 ? 64 : hwy::Num0BitsBelowLS1Bit_Nonzero64(~near);
    std::size_t j = HWY_MAX(HWY_MAX(from, behind), block * kBandBlock);
    block += more;
    near = more == 64 ? 0 : near >> more;
    const std::size_t to = HWY_MIN(end, block * kBandBlock);
    for (; j < HWY_MIN(i + kRows, to); j += kLanes)
      add_tile<true, kGeodesic>(g, width2, i, j, fresh, rows);
    for (; j < to; j += kLanes) add_tile<false, kGeodesic>(g, width2, i, j, fresh, rows);
  }
  add_four_sums(d, rows.sum, total + i);
}

// The runs of block b in pieces short enough for a sum: calls use(from, to, near) for each that has
// blocks near b. Bit 0 of `near` is the block that holds `from`.
template <class Use>
HWY_INLINE void for_pieces(const GaussPairs& pairs, const VF* width2, std::size_t b,
                           const BandRuns& runs, const Use& use) {
  for (std::uint32_t r = 0; r < runs.count; ++r) {
    for (std::uint32_t from = runs.first[r]; from < runs.end[r]; from += kRun) {
      const std::uint32_t to = HWY_MIN(from + kRun, runs.end[r]);
      std::uint64_t near = ~std::uint64_t{0} >> (63 - (to - 1) / kBandBlock + from / kBandBlock);
      if (pairs.boxed) near = near_blocks(pairs, width2, b, from / kBandBlock, band_blocks(to));
      if (near != 0) use(from, to, near);
    }
  }
}

HWY_INLINE void square_widths(const GaussPairs& pairs, VF* width2) {
  for (int s = 0; s < 2; ++s) width2[s] = hn::Set(DF(), pairs.width[s] * pairs.width[s]);
}

// Splits the blocks into parts that meet about as many others each. Boxes take time to compare, so
// of many blocks only some are looked at: one in seven of 30,000 contacts in a socket, in 4 us.
void split_pairs(const GaussSweep& sweep) {
  const GaussBands& g = sweep.bands[0];
  GaussPairs& pairs = *sweep.product;
  VF width2[2];
  square_widths(pairs, width2);
  const auto met_by = [&](std::size_t b) HWY_ATTR {
    const BandRuns& runs = g.runs[b];
    std::size_t met = 0;
    if (pairs.boxed)
      for_pieces(pairs, width2, b, runs,
                 [&](std::uint32_t, std::uint32_t, std::uint64_t near)
                     HWY_ATTR { met += hwy::PopCount(near); });
    for (std::uint32_t r = 0; r < runs.count && !pairs.boxed; ++r)
      met += runs.end[r] - runs.first[r];
    return met;
  };
  const std::size_t blocks = band_blocks(g.grid->count),
                    step = pairs.boxed ? HWY_MAX(blocks / 128, std::size_t{1}) : 1;
  std::size_t low = 0, high = (blocks + step - 1) / step, before = 0, behind = 0;
  while (low < high) {
    if (before <= behind)
      before += met_by(step * low++);
    else
      behind += met_by(step * --high);
  }
  pairs.split[0] = 0, pairs.split[1] = HWY_MIN(step * low, blocks), pairs.split[2] = blocks;
}

template <bool kGeodesic>
HWY_INLINE void sum_part(const GaussSweep& sweep, std::size_t part) {
  const DF d;
  const GaussBands& g = sweep.bands[0];
  const GaussPairs& pairs = *sweep.product;
  const std::size_t count = g.grid->count, padded = band_blocks(count) * kBandBlock;
  float *const fresh = pairs.fresh[part], *const total = pairs.sum[part];
  std::fill_n(fresh, padded, 0.0f);
  std::fill_n(total, padded, 0.0f);
  VF width2[2];
  square_widths(pairs, width2);
  const std::size_t end = pairs.split[part + 1];
  for (std::size_t first = pairs.split[part]; first < end; first += kFresh / kBandBlock) {
    std::size_t farthest = 0;
    for (std::size_t b = first; b < HWY_MIN(first + kFresh / kBandBlock, end); ++b) {
      const BandRuns& runs = g.runs[b];
      const std::size_t rows = HWY_MIN((b + 1) * kBandBlock, count);
      for_pieces(pairs, width2, b, runs,
                 [&](std::uint32_t from, std::uint32_t to, std::uint64_t near) HWY_ATTR {
                   for (std::size_t i = b * kBandBlock; i < rows; i += kRows)
                     add_group<kGeodesic>(pairs, width2, near, i, from, to, fresh, total);
                 });
      if (runs.count > 0) farthest = HWY_MAX(farthest, std::size_t{runs.end[runs.count - 1]});
    }
    for (std::size_t j = first * kBandBlock; j < farthest; j += kLanes) {
      hn::Store(hn::Add(hn::Load(d, total + j), hn::Load(d, fresh + j)), d, total + j);
      hn::Store(hn::Zero(d), d, fresh + j);
    }
  }
}

void sum_pairs(const GaussSweep& sweep, std::size_t part) {
  sweep.bands[0].geodesic ? sum_part<true>(sweep, part) : sum_part<false>(sweep, part);
}

// Adds up the sums of the parts.
void join_parts(const GaussSweep& sweep) {
  const DF d;
  const GaussBands& g = sweep.bands[0];
  const GaussPairs& pairs = *sweep.product;
  const VF unit =
      hn::Set(d, 1 / (pairs.width[0] * pairs.width[0] * pairs.width[1] * pairs.width[1]));
  for (std::size_t j = 0; j < g.grid->count; j += kLanes) {
    VF phi = hn::Load(d, pairs.sum[0] + j);
    for (std::size_t part = 1; part < kGaussSweepParts; ++part)
      phi = hn::Add(phi, hn::Load(d, pairs.sum[part] + j));
    hn::Store(hn::MulAdd(phi, unit, hn::Load(d, pairs.share + j)), d, pairs.sum[0] + j);
  }
}

// ---- weights

void weigh_rows(const GaussSweep& sweep, std::size_t begin, std::size_t end) {
  const DF d;
  const DirectionsView& c = sweep.contacts;
  const DI di;
  const VF zero = hn::Zero(d), self = hn::Set(d, sweep.densities == 2 ? 2.0f : 1.0f);
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    VF phi = zero;
    for (int p = 0; p < sweep.densities; ++p) {
      const GaussBands& g = sweep.bands[p];
      const auto place = load_n(di, reinterpret_cast<const std::int32_t*>(g.place) + i, live);
      phi = hn::Add(phi, hn::GatherIndex(d, g.order_only ? sweep.product->sum[0] : g.phi, place));
    }
    const VF facing = c.facing ? load_n(d, c.facing + i, live) : hn::Set(d, 1.0f);
    VF share = hn::Set(d, *sweep.per_share);
    if (c.depth != nullptr) share = hn::Mul(share, load_n(d, c.depth + i, live));
    if (c.facing != nullptr) share = hn::Mul(share, facing);
    // A density is at least the contact's own share, in spite of rounding.
    const VF own = hn::Mul(share, self);
    const VF weight = hn::Div(hn::Mul(facing, own), hn::Max(phi, own));
    store_n(hn::IfThenElseZero(hn::Gt(own, zero), weight), d, sweep.weight + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(gather_rows);
HWY_EXPORT(find_boxes);
HWY_EXPORT(split_pairs);
HWY_EXPORT(sum_pairs);
HWY_EXPORT(join_parts);
HWY_EXPORT(weigh_rows);

namespace {

constexpr std::size_t kBlocksASlice = 16;  // of 16 contacts each, stage 1
constexpr std::size_t kRowsASlice = 2048;  // stage 2

GaussSweep with_columns(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                        GaussColumns& columns) {
  GaussSweep sweep{};
  sweep.contacts = c;
  sweep.hat = hat;
  sweep.densities = hat == Hat::sum ? 2 : 1;
  columns.take(sweep.per_share, 2);  // one for each density
  columns.take(sweep.pairs, 2);
  const float* const normals[6] = {c.nx, c.ny, c.nz, c.tx, c.ty, c.tz};
  const float width[2] = {std::max(widths.normal, kMinWidth), std::max(widths.torque, kMinWidth)};
  for (int p = 0; p < sweep.densities; ++p) {
    GaussBands& g = sweep.bands[p];
    g.order_only = hat == Hat::product;
    std::copy_n(normals + 3 * p, 3, g.column);
    g.width = width[p];
    g.geodesic = widths.geodesic;
    lay_out_bands(g, c.count, columns);
  }
  if (hat != Hat::product) return sweep;
  columns.take(sweep.product, 1);
  GaussPairs pairs{};
  std::copy_n(normals, 6, pairs.column);
  std::copy_n(width, 2, pairs.width);
  const std::size_t rows = band_blocks(c.count) * kBandBlock;
  for (float*& at : pairs.at) columns.take(at, rows);
  columns.take(pairs.share, rows);
  for (float*& centre : pairs.centre) columns.take(centre, band_blocks(c.count) + kBandBlock);
  for (float*& half : pairs.half) columns.take(half, band_blocks(c.count) + kBandBlock);
  for (std::size_t part = 0; part < kGaussSweepParts; ++part) {
    columns.take(pairs.fresh[part], rows);
    columns.take(pairs.sum[part], rows);
  }
  if (sweep.product != nullptr) *sweep.product = pairs;
  return sweep;
}

std::size_t slices_of(std::size_t rows, std::size_t size) { return (rows + size - 1) / size; }

void sort(const GaussSweep& sweep, std::size_t density) {
  const DirectionsView& c = sweep.contacts;
  const bool weighted = c.facing != nullptr || c.depth != nullptr;
  sweep.per_share[density] = weighted ? gauss_per_share(c) : 1.0f;
  sweep.pairs[density] = sort_bands(sweep.bands[density], c, sweep.per_share[density]);
  if (sweep.product == nullptr) return;
  HWY_DYNAMIC_DISPATCH(gather_rows)(sweep);
  sweep.product->boxed = *sweep.pairs > kGaussBoxes * c.count && gauss_sweep_pays(sweep);
  if (sweep.product->boxed) HWY_DYNAMIC_DISPATCH(find_boxes)(sweep);
  HWY_DYNAMIC_DISPATCH(split_pairs)(sweep);
}

void sum(const GaussSweep& sweep, std::size_t slice) {
  if (sweep.hat == Hat::product) return HWY_DYNAMIC_DISPATCH(sum_pairs)(sweep, slice);
  const std::size_t blocks = band_blocks(sweep.contacts.count);
  const std::size_t each = slices_of(blocks, kBlocksASlice);
  const std::size_t first = slice % each * kBlocksASlice;
  sum_bands(sweep.bands[slice / each], first, first + kBlocksASlice);
}

}  // namespace

std::size_t gauss_sweep_bytes(std::size_t count, Hat hat) {
  GaussColumns counting{nullptr};
  DirectionsView c{};
  c.count = count;
  with_columns(c, hat, {1, 1}, counting);
  return counting.block_bytes();
}

GaussSweep gauss_sweep(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
                       float* weight) {
  GaussColumns columns = GaussColumns::in(memory);
  GaussSweep sweep = with_columns(c, hat, widths, columns);
  sweep.weight = weight;
  return sweep;
}

std::size_t gauss_sweep_slices(const GaussSweep& sweep, int stage) {
  const std::size_t count = sweep.contacts.count;
  if (count == 0) return 0;
  const auto densities = static_cast<std::size_t>(sweep.densities);
  if (stage == 0) return densities;
  if (sweep.hat == Hat::product) return stage == 1 ? kGaussSweepParts : 1;
  return stage == 1 ? densities * slices_of(band_blocks(count), kBlocksASlice)
                    : slices_of(count, kRowsASlice);
}

void gauss_sweep_run(const GaussSweep& sweep, int stage, std::size_t slice) {
  if (stage == 0) return sort(sweep, slice);
  if (stage == 1) return sum(sweep, slice);
  const std::size_t count = sweep.contacts.count;
  if (sweep.hat == Hat::product) {
    HWY_DYNAMIC_DISPATCH(join_parts)(sweep);
    return HWY_DYNAMIC_DISPATCH(weigh_rows)(sweep, 0, count);
  }
  const std::size_t first = slice * kRowsASlice;
  HWY_DYNAMIC_DISPATCH(weigh_rows)(sweep, first, std::min(first + kRowsASlice, count));
}

}  // namespace h6::kernels
#endif
