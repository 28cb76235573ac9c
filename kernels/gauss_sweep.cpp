// gauss_sweep.cpp - stages and weights of gauss_sweep.h; sorting along the line, windows and pairs
// of a product.
#include "kernels/gauss_sweep.h"

#include <algorithm>

#include "kernels/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/gauss_sweep.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

constexpr std::size_t kTile = 16;  // contacts that columns are padded to
using DF = hn::CappedTag<float, kTile>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());
constexpr std::size_t kRows = 4;  // a group: rows that share loads of columns

// The line: no wall of a machine is square to it, nor do two of its six directions meet on it.
constexpr float kLine[3] = {0.6104f, -0.3702f, 0.7003f};
// Farther than any hat reaches; its square is still a float.
constexpr float kNowhere = 1e15f;
constexpr std::size_t kSorted = 48;  // contacts from which sorting pays
constexpr std::size_t kMostBuckets = 2048;
// Rows whose hats a column sums before they join the total: rounding grows with the number of
// sums, not of contacts.
constexpr std::size_t kFresh = 128;
constexpr std::size_t kRun = 64 * kLanes;  // columns whose hats a row sums before, likewise

HWY_INLINE std::size_t whole_tiles(std::size_t rows) { return (rows + kTile - 1) / kTile * kTile; }

// ---- order

// Buckets of the contacts go to `bucket`; returns how many there are, and how many a hat spans.
struct Buckets {
  std::size_t count, reach;
};
HWY_INLINE Buckets buckets_of(const GaussLine& g, std::size_t count, float* along,
                              std::uint32_t* bucket) {
  const DF d;
  const DI di;
  VF low = hn::Set(d, 1e30f), high = hn::Set(d, -1e30f), size = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const std::size_t live = count - i;
    const VF x = load_n(d, g.column[0] + i, live), y = load_n(d, g.column[1] + i, live);
    const VF z = load_n(d, g.column[2] + i, live);
    VF p = hn::Mul(x, hn::Set(d, kLine[0]));
    p = hn::MulAdd(y, hn::Set(d, kLine[1]), p);
    p = hn::MulAdd(z, hn::Set(d, kLine[2]), p);
    size = hn::Max(size, hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z))));
    // Lanes past the end repeat a real one.
    if (live < kLanes) p = hn::IfThenElse(hn::FirstN(d, live), p, hn::Set(d, hn::GetLane(p)));
    hn::StoreU(p, d, along + i);
    low = hn::Min(low, p), high = hn::Max(high, p);
  }
  const float first = hn::GetLane(hn::MinOfLanes(d, low));
  const float extent = hn::GetLane(hn::MaxOfLanes(d, high)) - first;
  std::size_t buckets = 64;
  while (buckets < kMostBuckets && 2 * buckets < count) buckets *= 2;
  // Twice a width is enough to the bucket: more would only spread them.
  const float scale = extent > 0 ? static_cast<float>(buckets - 1) / extent : 0.0f;
  const auto last = hn::Set(di, static_cast<std::int32_t>(buckets - 1));
  for (std::size_t i = 0; i < count; i += kLanes) {
    const VF p = hn::Mul(hn::Sub(hn::LoadU(d, along + i), hn::Set(d, first)), hn::Set(d, scale));
    // Whatever a NaN becomes, the bucket stays in range.
    const auto b = hn::Min(hn::Max(hn::ConvertTo(di, p), hn::Zero(di)), last);
    hn::StoreU(b, di, reinterpret_cast<std::int32_t*>(bucket) + i);
  }
  // A place is rounded by less than 1e-6 of the longest vector.
  const float most = hn::GetLane(hn::MaxOfLanes(d, size));
  const float reach = (g.width[0] * 1.0001f + 2e-6f * most) * scale + 1;
  return {buckets,
          reach < static_cast<float>(buckets) ? static_cast<std::size_t>(reach) + 1 : buckets};
}

// Columns in the order of `source`, with their padding. `source` may be where the shares go.
HWY_INLINE void gather_rows(const GaussSweep& sweep, const GaussLine& g, float per_share,
                            const std::uint32_t* source) {
  const DF d;
  const DI di;
  const DirectionsView& c = sweep.contacts;
  for (std::size_t i = 0; i < c.count; i += kLanes) {
    const auto row = hn::Load(di, reinterpret_cast<const std::int32_t*>(source) + i);
    const auto real = hn::FirstN(d, c.count - i);
    for (int k = 0; k < 6; ++k) {
      const VF v = hn::GatherIndex(d, g.column[k], row);
      hn::Store(hn::IfThenElse(real, v, hn::Set(d, kNowhere)), d, g.at[k] + i);
    }
    if (c.facing == nullptr && c.depth == nullptr) continue;
    VF share = hn::Set(d, per_share);
    if (c.depth != nullptr) share = hn::Mul(share, hn::GatherIndex(d, c.depth, row));
    if (c.facing != nullptr) share = hn::Mul(share, hn::GatherIndex(d, c.facing, row));
    hn::Store(hn::IfThenElseZero(real, share), d, g.share + i);
  }
  const std::size_t padded = whole_tiles(c.count);
  for (std::size_t i = (c.count + kLanes - 1) / kLanes * kLanes; i < padded; i += kLanes) {
    for (int k = 0; k < 6; ++k) hn::Store(hn::Set(d, kNowhere), d, g.at[k] + i);
    hn::Store(hn::Zero(d), d, g.share + i);
  }
}

void sort_line(const GaussSweep& sweep) {
  const GaussLine& g = sweep.line;
  const DirectionsView& c = sweep.contacts;
  const std::size_t count = c.count, padded = whole_tiles(count);
  const std::size_t groups = (count + kRows - 1) / kRows;
  const bool weighted = c.facing != nullptr || c.depth != nullptr;
  const float per_share = weighted ? gauss_per_share(c) : 1.0f;
  *sweep.per_share = per_share;

  std::uint64_t pairs = 0;
  std::uint32_t* const source = reinterpret_cast<std::uint32_t*>(g.share);
  if (count < kSorted) {
    for (std::size_t i = 0; i < count; ++i) g.place[i] = source[i] = static_cast<std::uint32_t>(i);
    for (std::size_t q = 0; q < groups; ++q) g.end[q] = static_cast<std::uint32_t>(count);
  } else {
    std::uint32_t start[kMostBuckets + 1];
    std::uint32_t* const bucket = reinterpret_cast<std::uint32_t*>(g.row);
    const Buckets buckets = buckets_of(g, count, g.at[0], bucket);
    std::fill_n(start, buckets.count + 1, 0u);
    for (std::size_t i = 0; i < count; ++i) g.place[i] = start[bucket[i]]++;
    std::uint32_t sum = 0;
    for (std::size_t b = 0; b <= buckets.count; ++b) {
      const std::uint32_t here = start[b];
      start[b] = sum;
      sum += here;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t to = g.place[i] + start[bucket[i]];
      g.place[i] = to;
      source[to] = static_cast<std::uint32_t>(i);
    }
    for (std::size_t q = 0; q < groups; ++q) {
      const std::uint32_t last = bucket[source[HWY_MIN(q * kRows + kRows, count) - 1]];
      g.end[q] = start[HWY_MIN(last + buckets.reach + 1, buckets.count)];
      pairs += g.end[q] - q * kRows;
    }
  }
  std::fill_n(source + count, padded - count, 0u);
  *sweep.pairs = pairs * kRows;
  gather_rows(sweep, g, per_share, source);
  // Half of the pairs to each part.
  g.split[0] = 0, g.split[1] = g.split[2] = groups * kRows;
  if (count < kSorted) return;
  std::uint64_t seen = 0;
  std::size_t q = 0;
  for (; 2 * seen < pairs; ++q) seen += g.end[q] - q * kRows;
  g.split[1] = q * kRows;
}

// ---- pairs

// Rows i .. i + kRows - 1.
struct Group {
  VF at[kRows][3], share[kRows], sum[kRows];
};

template <bool kWeighted, bool kMasked>
HWY_INLINE void add_tile(const GaussLine& g, const VF* width2, std::size_t i, std::size_t j,
                         float* column, Group& rows) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF x[6], hat[kRows];
  for (int k = 0; k < 3; ++k) x[k] = hn::Load(d, g.at[k] + j);
  const auto gap_to_edge = [&](std::size_t r, int s) HWY_ATTR {
    VF v = width2[s];
    HWY_UNROLL(3)
    for (int k = 3 * s; k < 3 * s + 3; ++k) {
      // Registers hold one sphere's; the other's come with the subtraction.
      const VF at = s == 0 ? rows.at[r][k] : hn::Set(d, g.at[k][i + r]);
      const VF gap = hn::Sub(x[k], at);
      v = hn::NegMulAdd(gap, gap, v);
    }
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
  VF sum = hn::Load(d, column + j);
  if constexpr (kWeighted) {
    const VF share = hn::Load(d, g.share + j);
    HWY_UNROLL(4)
    for (std::size_t r = 0; r < kRows; ++r) {
      rows.sum[r] = hn::MulAdd(share, hat[r], rows.sum[r]);
      sum = hn::MulAdd(rows.share[r], hat[r], sum);
    }
  } else {
    HWY_UNROLL(4)
    for (std::size_t r = 0; r < kRows; ++r) rows.sum[r] = hn::Add(rows.sum[r], hat[r]);
    sum = hn::Add(sum, hn::Add(hn::Add(hat[0], hat[1]), hn::Add(hat[2], hat[3])));
  }
  hn::Store(sum, d, column + j);
}

// Sums of four vectors' lanes, to to[0..3].
HWY_INLINE void store_sums(const VF* sum, float* to) {
  const DF d;
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t r = 0; r < kRows; ++r) to[r] = hn::GetLane(hn::SumOfLanes(d, sum[r]));
#else
  const auto fold = [&](VF a, VF b) HWY_ATTR {
    return hn::Add(hn::InterleaveLower(d, a, b), hn::InterleaveUpper(d, a, b));
  };
  // In every block of four: rows 0 1 2 3.
  const VF rows = fold(fold(sum[0], sum[2]), fold(sum[1], sum[3]));
  const hn::CappedTag<float, 4> d4;
  HWY_ALIGN float blocks[kTile];
  hn::Store(rows, d, blocks);
  auto total = hn::Load(d4, blocks);
  for (std::size_t block = 4; block < kLanes; block += 4)
    total = hn::Add(total, hn::Load(d4, blocks + block));
  hn::StoreU(total, d4, to);
#endif
}

// A group's rows from `i` on, with columns from `j` to `end`; returns where it stopped.
template <bool kWeighted>
HWY_INLINE std::size_t add_group(const GaussLine& g, const VF* width2, std::size_t i, std::size_t j,
                                 std::size_t end, float* fresh) {
  const DF d;
  Group rows;
  HWY_UNROLL(4)
  for (std::size_t r = 0; r < kRows; ++r) {
    for (int k = 0; k < 3; ++k) rows.at[r][k] = hn::Set(d, g.at[k][i + r]);
    if (kWeighted) rows.share[r] = hn::Set(d, g.share[i + r]);
    rows.sum[r] = hn::Zero(d);
  }
  for (; j < i + kRows; j += kLanes) add_tile<kWeighted, true>(g, width2, i, j, fresh, rows);
  for (; j < end; j += kLanes) add_tile<kWeighted, false>(g, width2, i, j, fresh, rows);
  store_sums(rows.sum, g.row + i);
  return j;
}

template <bool kWeighted>
HWY_INLINE void add_pairs(const GaussLine& g, std::size_t count, std::size_t part) {
  const DF d;
  const std::size_t begin = g.split[part], end = g.split[part + 1], padded = whole_tiles(count);
  float *const fresh = g.fresh[part], *const total = g.sum[part];
  std::fill_n(fresh, padded, 0.0f);
  std::fill_n(total, padded, 0.0f);
  VF width2[2];
  for (int s = 0; s < 2; ++s) width2[s] = hn::Set(d, g.width[s] * g.width[s]);
  for (std::size_t first = begin; first < end; first += kFresh) {
    const std::size_t behind = HWY_MIN(first + kFresh, end);
    std::size_t farthest = 0;
    for (std::size_t i = first; i < behind; i += kRows) {
      const std::size_t window = g.end[i / kRows];
      std::size_t j = i / kLanes * kLanes;
      j = add_group<kWeighted>(g, width2, i, j, HWY_MIN(window, j + kRun), fresh);
      while (HWY_UNLIKELY(j < window)) {
        float before[kRows];
        std::copy_n(g.row + i, kRows, before);
        j = add_group<kWeighted>(g, width2, i, j, HWY_MIN(window, j + kRun), fresh);
        for (std::size_t r = 0; r < kRows; ++r) g.row[i + r] += before[r];
      }
      farthest = HWY_MAX(farthest, j);
    }
    for (std::size_t j = first / kLanes * kLanes; j < farthest; j += kLanes) {
      hn::Store(hn::Add(hn::Load(d, total + j), hn::Load(d, fresh + j)), d, total + j);
      hn::Store(hn::Zero(d), d, fresh + j);
    }
  }
}

void sum_pairs(const GaussSweep& sweep, std::size_t part) {
  const std::size_t count = sweep.contacts.count;
  const bool weighted = sweep.contacts.facing != nullptr || sweep.contacts.depth != nullptr;
  weighted ? add_pairs<true>(sweep.line, count, part) : add_pairs<false>(sweep.line, count, part);
}

// ---- weights

// Adds up what the parts of a product summed.
void join_parts(const GaussSweep& sweep) {
  const DF d;
  const GaussLine& g = sweep.line;
  const DirectionsView& c = sweep.contacts;
  const bool weighted = c.facing != nullptr || c.depth != nullptr;
  const float unit = 1 / (g.width[0] * g.width[0] * g.width[1] * g.width[1]);
  for (std::size_t j = 0; j < c.count; j += kLanes) {
    VF phi = hn::Load(d, g.row + j);
    for (const float* sum : g.sum) phi = hn::Add(phi, hn::Load(d, sum + j));
    const VF own = weighted ? hn::Load(d, g.share + j) : hn::Set(d, 1.0f);
    hn::Store(hn::MulAdd(phi, hn::Set(d, unit), own), d, g.row + j);
  }
}

void weigh_rows(const GaussSweep& sweep, std::size_t begin, std::size_t end) {
  const DF d;
  const DirectionsView& c = sweep.contacts;
  const DI di;
  const VF zero = hn::Zero(d), self = hn::Set(d, sweep.densities == 2 ? 2.0f : 1.0f);
  for (std::size_t i = begin; i < end; i += kLanes) {
    const std::size_t live = end - i;
    VF phi = zero;
    for (int p = 0; p < sweep.densities; ++p) {
      const bool product = sweep.hat == Hat::product;
      const std::uint32_t* const places = product ? sweep.line.place : sweep.bands[p].place;
      const auto place = load_n(di, reinterpret_cast<const std::int32_t*>(places) + i, live);
      phi = hn::Add(phi, hn::GatherIndex(d, product ? sweep.line.row : sweep.bands[p].phi, place));
    }
    const VF facing = c.facing ? load_n(d, c.facing + i, live) : hn::Set(d, 1.0f);
    VF share = hn::Set(d, *sweep.per_share);
    if (c.depth != nullptr) share = hn::Mul(share, load_n(d, c.depth + i, live));
    if (c.facing != nullptr) share = hn::Mul(share, facing);
    // A contact's own share is in its density, whatever rounding takes from a light one.
    const VF own = hn::Mul(share, self);
    const VF weight = hn::Div(hn::Mul(facing, own), hn::Max(phi, own));
    store_n(hn::IfThenElseZero(hn::Gt(own, zero), weight), d, sweep.weight + i, live);
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sort_line);
HWY_EXPORT(sum_pairs);
HWY_EXPORT(join_parts);
HWY_EXPORT(weigh_rows);

namespace {

constexpr std::size_t kBlocksASlice = 16;  // summed, of 16 contacts each
constexpr std::size_t kRowsASlice = 2048;  // weighed

void lay_out_line(GaussLine& g, std::size_t count, GaussColumns& columns) {
  const std::size_t rows = (count + 15) / 16 * 16;
  for (float*& at : g.at) columns.take(at, rows);
  columns.take(g.share, rows);
  columns.take(g.row, rows);
  for (std::size_t part = 0; part < kGaussSweepParts; ++part) {
    columns.take(g.fresh[part], rows);
    columns.take(g.sum[part], rows);
  }
  columns.take(g.place, rows);
  columns.take(g.end, rows / 4);
  columns.take(g.split, kGaussSweepParts + 1);
}

GaussSweep with_columns(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                        GaussColumns& columns) {
  GaussSweep sweep{};
  sweep.contacts = c;
  sweep.hat = hat;
  sweep.densities = hat == Hat::sum ? 2 : 1;
  columns.take(sweep.per_share, 2);  // one for each density that sorts
  columns.take(sweep.pairs, 2);
  const float* const normals[6] = {c.nx, c.ny, c.nz, c.tx, c.ty, c.tz};
  const float width[2] = {std::max(widths.normal, kMinWidth), std::max(widths.torque, kMinWidth)};
  if (hat == Hat::product) {
    std::copy_n(normals, 6, sweep.line.column);
    std::copy_n(width, 2, sweep.line.width);
    lay_out_line(sweep.line, c.count, columns);
    return sweep;
  }
  for (int p = 0; p < sweep.densities; ++p) {
    std::copy_n(normals + 3 * p, 3, sweep.bands[p].column);
    sweep.bands[p].width = width[p];
    lay_out_bands(sweep.bands[p], c.count, columns);
  }
  return sweep;
}

std::size_t slices_of(std::size_t rows, std::size_t size) { return (rows + size - 1) / size; }

void sort(const GaussSweep& sweep, std::size_t density) {
  if (sweep.hat == Hat::product) return HWY_DYNAMIC_DISPATCH(sort_line)(sweep);
  const DirectionsView& c = sweep.contacts;
  const bool weighted = c.facing != nullptr || c.depth != nullptr;
  sweep.per_share[density] = weighted ? gauss_per_share(c) : 1.0f;
  sweep.pairs[density] = sort_bands(sweep.bands[density], c, sweep.per_share[density]);
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
