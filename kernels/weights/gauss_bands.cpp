// SPDX-License-Identifier: Apache-2.0
// gauss_bands.cpp - the sorting and the runs of gauss_bands.h.
#include "kernels/weights/gauss_bands.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_bands.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/compress-inl.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::CappedTag<float, kBandBlock>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
constexpr std::size_t kLanes = hn::MaxLanes(DF());

// The line on which bands lie. No wall of a machine is perpendicular to it, and the six directions
// of axis-parallel walls fall on different places. The second direction is perpendicular to it.
constexpr float kLine[3] = {0.6104f, -0.3702f, 0.7003f};
constexpr float kAcross[3] = {-0.7690f, -0.0652f, 0.6359f};
constexpr std::size_t kSorted = 48;       // fewest contacts for which sorting pays
constexpr std::size_t kManyBands = 4096;  // fewest for several bands of a product

// ---- order

constexpr std::size_t kWorthJoining = 16;  // merge when at least one contact in 16 is saved

// The contacts from i on that differ from the one before.
HWY_INLINE hn::Mask<DF> differing(const GaussBands& g, std::size_t i, std::size_t live) {
  const DF d;
  auto same = hn::FirstN(d, live);
  for (const float* column : g.column) {
    if (HWY_UNLIKELY(i == 0)) {
      HWY_ALIGN float before[kLanes] = {
          std::numeric_limits<float>::quiet_NaN()};  // the first contact differs
      std::copy_n(column, HWY_MIN(live, kLanes) - 1, before + 1);
      same = hn::And(same, hn::Eq(load_n(d, column, live), hn::Load(d, before)));
    } else {
      same = hn::And(same, hn::Eq(load_n(d, column + i, live), load_n(d, column + i - 1, live)));
    }
  }
  return hn::AndNot(same, hn::FirstN(d, live));
}

HWY_INLINE float share_of(const DirectionsView& c, std::size_t i, float per_share) {
  if (c.depth != nullptr) per_share *= c.depth[i];
  if (c.facing != nullptr) per_share *= c.facing[i];
  return per_share;
}

// The items that are sorted: contacts, or runs of equal contacts where there are many of these.
struct Items {
  const float* v[3];
  const float* mass;          // null: items are the contacts
  const std::uint32_t* head;  // null: items are the contacts
  std::size_t count;
};

HWY_INLINE Items items_of(const GaussBands& g, const DirectionsView& c, float per_share) {
  const DF d;
  const DI di;
  const Items all{{g.column[0], g.column[1], g.column[2]}, nullptr, nullptr, c.count};
  if (g.order_only) return all;
  // A quarter of the contacts is looked at to decide whether merging pays.
  std::size_t seen = 0, left = 0;
  for (std::size_t i = 0; i < c.count; i += 4 * kLanes) {
    left += hn::CountTrue(d, differing(g, i, c.count - i));
    seen += HWY_MIN(kLanes, c.count - i);
  }
  if (kWorthJoining * (seen - left) < seen) return all;
  left = 0;
  for (std::size_t i = 0; i < c.count; i += kLanes) {
    const std::size_t live = c.count - i;
    const auto fresh = differing(g, i, live);
    for (int k = 0; k < 3; ++k)
      hn::StoreU(compress(d, load_n(d, g.column[k] + i, live), fresh), d, g.direction[k] + left);
    const auto at = hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(i)));
    hn::StoreU(compress(di, at, hn::RebindMask(di, fresh)), di,
               reinterpret_cast<std::int32_t*>(g.head) + left);
    left += hn::CountTrue(d, fresh);
  }
  g.head[left] = static_cast<std::uint32_t>(c.count);
  const bool weighted = c.depth != nullptr || c.facing != nullptr;
  for (std::size_t j = 0; j < left; ++j) {
    g.mass[j] = static_cast<float>(static_cast<std::int32_t>(g.head[j + 1] - g.head[j]));
    if (!weighted) continue;
    g.mass[j] = 0;
    for (std::size_t i = g.head[j]; i < g.head[j + 1]; ++i) g.mass[j] += share_of(c, i, per_share);
  }
  return {{g.direction[0], g.direction[1], g.direction[2]}, g.mass, g.head, left};
}

struct Range {
  float low, extent;
};

// The first hat of a product is wide, so there are few bands; with few contacts a block would lie
// in several of them.
HWY_INLINE bool in_one_band(const GaussBands& g, std::size_t count) {
  return g.order_only && count < kManyBands;
}

// Coordinates along both directions; returns the largest component of any vector.
HWY_INLINE float project(const Items& items, float* const* along, Range* range) {
  const DF d;
  const std::size_t count = items.count;
  VF low[2], high[2], size = hn::Zero(d);
  for (int k = 0; k < 2; ++k) low[k] = hn::Set(d, 1e30f), high[k] = hn::Set(d, -1e30f);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const std::size_t live = count - i;
    const VF x = load_n(d, items.v[0] + i, live), y = load_n(d, items.v[1] + i, live);
    const VF z = load_n(d, items.v[2] + i, live);
    size = hn::Max(size, hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z))));
    for (int k = 0; k < 2; ++k) {
      const float* u = k == 0 ? kLine : kAcross;
      VF p = hn::Mul(x, hn::Set(d, u[0]));
      p = hn::MulAdd(y, hn::Set(d, u[1]), p);
      p = hn::MulAdd(z, hn::Set(d, u[2]), p);
      // Lanes past the end repeat a real one.
      if (live < kLanes) p = hn::IfThenElse(hn::FirstN(d, live), p, hn::Set(d, hn::GetLane(p)));
      hn::StoreU(p, d, along[k] + i);
      low[k] = hn::Min(low[k], p), high[k] = hn::Max(high[k], p);
    }
  }
  for (int k = 0; k < 2; ++k) {
    range[k].low = hn::GetLane(hn::MinOfLanes(d, low[k]));
    range[k].extent = hn::GetLane(hn::MaxOfLanes(d, high[k])) - range[k].low;
  }
  return hn::GetLane(hn::MaxOfLanes(d, size));
}

HWY_INLINE void choose_grid(const GaussBands& g, std::size_t count, const Range* range, float size,
                            float* scale) {
  // A coordinate is rounded by less than 1e-6 of the longest vector, a cell number by less.
  const float reach = g.width * 1.001f + 4e-6f * size;
  const std::uint32_t most = band_cells(count) / (in_one_band(g, count) ? 4 : 1);
  GaussBands::Grid& grid = *g.grid;
  const float fit = range[0].extent / reach;
  grid.bands = fit > 1 ? static_cast<std::uint32_t>(HWY_MIN(fit, static_cast<float>(most / 8))) : 1;
  if (in_one_band(g, count)) grid.bands = 1;
  grid.shift = 0;
  while ((grid.bands << (grid.shift + 1)) <= most) ++grid.shift;
  grid.cells = grid.bands << grid.shift;
  const float cells = static_cast<float>(1u << grid.shift);
  scale[0] = range[0].extent > 0 ? static_cast<float>(grid.bands) / range[0].extent : 0.0f;
  scale[1] = range[1].extent > 0 ? cells / range[1].extent : 0.0f;
  const float far = reach * scale[1] + 1;
  grid.reach = static_cast<std::uint32_t>(far < cells ? far : cells);
}

HWY_INLINE hn::Vec<DI> cell_along(const float* along, const Range& range, float scale,
                                  std::uint32_t cells) {
  const DF d;
  const DI di;
  const VF at = hn::Mul(hn::Sub(hn::LoadU(d, along), hn::Set(d, range.low)), hn::Set(d, scale));
  // The cell is in range for a NaN too.
  return hn::Min(hn::Max(hn::ConvertTo(di, at), hn::Zero(di)),
                 hn::Set(di, static_cast<std::int32_t>(cells - 1)));
}

// Turns the counts of the cells into their first places.
HWY_INLINE void place_cells(const GaussBands& g) {
  std::uint32_t sum = 0;
  for (std::uint32_t cell = 0; cell <= g.grid->cells; ++cell) {
    const std::uint32_t here = g.start[cell];
    g.start[cell] = sum;
    sum += here;
  }
}

// Moves every item j to place to(j).
template <class To>
HWY_INLINE void put(const GaussBands& g, const Items& items, const DirectionsView& c,
                    float per_share, const To& to) {
  if (g.order_only) {
    for (std::size_t j = 0; j < items.count; ++j) {
      const std::uint32_t there = to(j);
      g.place[j] = there;
      g.source[there] = static_cast<std::uint32_t>(j);
    }
    return;
  }
  const float *const x = items.v[0], *const y = items.v[1], *const z = items.v[2];
  const auto each = [&](const auto& share, const auto& place) HWY_ATTR {
    for (std::size_t j = 0; j < items.count; ++j) {
      const std::uint32_t there = to(j);
      float* const at = g.at + 4 * std::size_t{there};
      at[0] = x[j], at[1] = y[j], at[2] = z[j], at[3] = share(j);
      place(j, there);
    }
  };
  const auto alone = [&](std::size_t j, std::uint32_t there) { g.place[j] = there; };
  if (items.head != nullptr) {
    each([&](std::size_t j) { return items.mass[j]; },
         [&](std::size_t j, std::uint32_t there) {
           std::size_t i = items.head[j];
           do g.place[i] = there;
           while (HWY_UNLIKELY(++i < items.head[j + 1]));
         });
  } else if (c.depth != nullptr || c.facing != nullptr) {
    each([&](std::size_t j) { return share_of(c, j, per_share); }, alone);
  } else {
    each([](std::size_t) { return 1.0f; }, alone);
  }
}

HWY_INLINE BandRuns runs_of(const GaussBands& g, std::size_t block) {
  const GaussBands::Grid& grid = *g.grid;
  BandRuns runs{{}, {grid.count}, 1};
  if (grid.count < kSorted) return runs;
  const std::uint32_t along = (1u << grid.shift) - 1;
  const std::size_t first = block * kBandBlock;
  const std::size_t last = HWY_MIN(first + kBandBlock, std::size_t{grid.count}) - 1;
  const std::uint32_t a = g.cell_at[first], b = g.cell_at[last];
  const std::uint32_t band_a = a >> grid.shift, band_b = b >> grid.shift;
  const std::uint32_t low = band_a > 0 ? band_a - 1 : 0;
  const std::uint32_t high = HWY_MIN(band_b + 1, grid.bands - 1);
  if (band_b - band_a > 1) {
    runs.first[0] = g.start[low << grid.shift];
    runs.end[0] = g.start[(high + 1) << grid.shift];
    return runs;
  }
  // Cell numbers in the direction of even bands. A block in two bands lies around the end that they
  // share.
  const std::uint32_t odd_a = band_a % 2 * along, odd_b = band_b % 2 * along;
  const std::uint32_t ca = (a & along) ^ odd_a, cb = (b & along) ^ odd_b;
  std::uint32_t from = HWY_MIN(ca, cb), to = HWY_MAX(ca, cb);
  if (band_a != band_b) (odd_a == 0 ? to : from) = odd_a == 0 ? along : 0;
  from = from > grid.reach ? from - grid.reach : 0;
  to = HWY_MIN(to + grid.reach, along);
  runs.count = 0;
  for (std::uint32_t band = low; band <= high; ++band) {
    const std::uint32_t* const start = g.start + (band << grid.shift);
    const bool odd = band % 2 == 1;
    runs.first[runs.count] = start[odd ? along - to : from];
    runs.end[runs.count] = start[(odd ? along - from : to) + 1];
    runs.count += runs.first[runs.count] < runs.end[runs.count];
  }
  return runs;
}

// Keeps what lies in the block or behind it, in whole vectors.
HWY_INLINE void keep_behind(std::size_t block, BandRuns& runs) {
  constexpr std::uint32_t kLane = kLanes;
  std::uint32_t next = static_cast<std::uint32_t>(block * kBandBlock), count = 0;
  for (std::uint32_t r = 0; r < runs.count; ++r) {
    const std::uint32_t first = HWY_MAX(runs.first[r] / kLane * kLane, next);
    const std::uint32_t end = (runs.end[r] + kLane - 1) / kLane * kLane;
    if (first >= end) continue;
    runs.first[count] = first, runs.end[count++] = next = end;
  }
  runs.count = count;
}

HWY_INLINE std::uint64_t list_runs(const GaussBands& g, std::size_t blocks) {
  std::uint64_t met = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    BandRuns runs = runs_of(g, b);
    if (g.order_only) keep_behind(b, runs);
    g.runs[b] = runs;
    for (std::uint32_t r = 0; r < runs.count; ++r) met += runs.end[r] - runs.first[r];
  }
  return met * kBandBlock;
}

std::uint64_t sort_simd(const GaussBands& g, const DirectionsView& c, float per_share) {
  GaussBands::Grid& grid = *g.grid;
  const Items items = items_of(g, c, per_share);
  const std::size_t count = items.count, blocks = band_blocks(count);
  grid = {static_cast<std::uint32_t>(count), 1, 1, 0, 1};
  if (count < kSorted) {
    put(g, items, c, per_share, [](std::size_t j) { return static_cast<std::uint32_t>(j); });
  } else {
    const DI di;
    float* along[2] = {g.at, g.at + blocks * kBandBlock};
    Range range[2];
    float scale[2];
    const float size = project(items, along, range);
    std::uint32_t* const cell = reinterpret_cast<std::uint32_t*>(g.phi);
    // `place` is overwritten while merged items are put, so their ranks need a column of their own.
    std::uint32_t* const rank = items.head != nullptr ? g.rank : g.place;
    if (in_one_band(g, count)) along[1] = along[0], range[1] = range[0];
    choose_grid(g, count, range, size, scale);
    const std::uint32_t cells = 1u << grid.shift;
    const auto last = hn::Set(di, static_cast<std::int32_t>(cells - 1));
    for (std::size_t j = 0; j < count; j += kLanes) {
      const auto band = cell_along(along[0] + j, range[0], scale[0], grid.bands);
      const auto q = cell_along(along[1] + j, range[1], scale[1], cells);
      // Odd bands run backwards: where a band ends, the next one begins.
      const auto odd = hn::Ne(hn::And(band, hn::Set(di, 1)), hn::Zero(di));
      const auto turned = hn::Xor(q, hn::IfThenElseZero(odd, last));
      hn::StoreU(hn::Or(hn::ShiftLeftSame(band, static_cast<int>(grid.shift)), turned), di,
                 reinterpret_cast<std::int32_t*>(cell) + j);
    }
    std::fill_n(g.start, grid.cells + 1, 0u);
    for (std::size_t j = 0; j < count; ++j) rank[j] = g.start[cell[j]]++;
    place_cells(g);
    put(g, items, c, per_share, [&](std::size_t j) {
      const std::uint32_t there = g.start[cell[j]] + rank[j];
      g.cell_at[there] = cell[j];
      return there;
    });
  }
  for (std::size_t j = count; j < blocks * kBandBlock; ++j) {
    if (g.order_only) {
      g.source[j] = 0;
      continue;
    }
    std::copy_n(g.at + 4 * (count - 1), 3, g.at + 4 * j);
    g.at[4 * j + 3] = 0;
  }
  return list_runs(g, blocks);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(sort_simd);

std::uint64_t sort_bands(const GaussBands& g, const DirectionsView& c, float per_share) {
  return HWY_DYNAMIC_DISPATCH(sort_simd)(g, c, per_share);
}
void lay_out_bands(GaussBands& g, std::size_t count, GaussColumns& columns) {
  const std::size_t blocks = band_blocks(count), rows = blocks * kBandBlock;
  if (g.order_only) {
    columns.take(g.at, 2 * rows);
    columns.take(g.source, rows);
  } else {
    for (float*& direction : g.direction) columns.take(direction, rows + kBandBlock);
    columns.take(g.mass, rows);
    columns.take(g.head, rows + kBandBlock);
    columns.take(g.at, 4 * rows);
  }
  columns.take(g.phi, rows);
  columns.take(g.place, rows);
  columns.take(g.rank, rows);
  columns.take(g.start, band_cells(count) + 1);
  columns.take(g.cell_at, rows);
  columns.take(g.runs, blocks);
  columns.take(g.grid, 1);
}

}  // namespace h6::kernels
#endif
