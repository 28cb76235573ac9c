// lane_loads-inl.h - 16 bytes from an address of its own for each lane, turned into columns.
//
// Included once for each SIMD target. Where a lane wants several words that lie together, this
// takes one load where gathers take one for each word.
//
//   lane 0 -> a0 b0 c0 d0          column 0: a0 a1 a2 a3 ...
//   lane 1 -> a1 b1 c1 d1          column 1: b0 b1 b2 b3 ...
//   lane 2 -> a2 b2 c2 d2   --->   column 2: c0 c1 c2 c3 ...
//   lane 3 -> a3 b3 c3 d3          column 3: d0 d1 d2 d3 ...
#include <cstddef>
#include <cstdint>
#include <cstring>

// Per-target include guard.
#if defined(H6_KERNELS_LANE_LOADS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_LANE_LOADS_INL_H_
#undef H6_KERNELS_LANE_LOADS_INL_H_
#else
#define H6_KERNELS_LANE_LOADS_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using LaneTag = hn::ScalableTag<std::int32_t>;
using LaneWords = hn::Vec<LaneTag>;

#if HWY_TARGET == HWY_SCALAR

template <class At>
HWY_INLINE void load_quads(const At& at, LaneWords column[4]) {
  std::int32_t word[4];
  std::memcpy(word, at(0), sizeof word);
  for (int k = 0; k < 4; ++k) column[k] = hn::Set(LaneTag(), word[k]);
}

// The pairs at a cell's lower and upper y, 5 nodes apart, in a layer of a brick.
HWY_INLINE void load_brick_pairs(const std::int16_t* layer, const std::int32_t* offset,
                                 LaneWords& low, LaneWords& high) {
  std::int32_t word[2];
  std::memcpy(&word[0], layer + offset[0], sizeof word[0]);
  std::memcpy(&word[1], layer + offset[0] + 5, sizeof word[1]);
  low = hn::Set(LaneTag(), word[0]), high = hn::Set(LaneTag(), word[1]);
}

#else

// Row j: what lanes j, 4 + j, 8 + j ... have at their addresses, a block of 16 bytes each.
template <class At>
HWY_INLINE LaneWords load_row(const At& at, std::size_t j) {
  const hn::Full128<std::int32_t> block;
  const auto load = [&](std::size_t lane) HWY_ATTR {
    return hn::BitCast(block, hn::LoadU(hn::Full128<std::uint8_t>(),
                                        reinterpret_cast<const std::uint8_t*>(at(lane))));
  };
#if HWY_MAX_BYTES == 64
  const hn::Full256<std::int32_t> pair;
  return hn::Combine(LaneTag(), hn::Combine(pair, load(j + 12), load(j + 8)),
                     hn::Combine(pair, load(j + 4), load(j)));
#elif HWY_MAX_BYTES == 32
  return hn::Combine(LaneTag(), load(j + 4), load(j));
#else
  return load(j);
#endif
}

template <class At>
HWY_INLINE void load_quads(const At& at, LaneWords column[4]) {
  const LaneTag d;
  const hn::RepartitionToWide<LaneTag> wide;
  const auto words = [&](auto v) HWY_ATTR { return hn::BitCast(d, v); };
  const auto doubles = [&](auto v) HWY_ATTR { return hn::BitCast(wide, v); };
  const auto r0 = load_row(at, 0), r1 = load_row(at, 1), r2 = load_row(at, 2);
  const auto r3 = load_row(at, 3);
  const auto low01 = doubles(hn::InterleaveLower(d, r0, r1));
  const auto low23 = doubles(hn::InterleaveLower(d, r2, r3));
  const auto high01 = doubles(hn::InterleaveUpper(d, r0, r1));
  const auto high23 = doubles(hn::InterleaveUpper(d, r2, r3));
  column[0] = words(hn::InterleaveLower(wide, low01, low23));
  column[1] = words(hn::InterleaveUpper(wide, low01, low23));
  column[2] = words(hn::InterleaveLower(wide, high01, high23));
  column[3] = words(hn::InterleaveUpper(wide, high01, high23));
}

// The pairs at a cell's lower and upper y, 5 nodes apart, in a layer of a brick.
HWY_INLINE void load_brick_pairs(const std::int16_t* layer, const std::int32_t* offset,
                                 LaneWords& low, LaneWords& high) {
  const LaneTag d;
  const hn::Repartition<std::uint8_t, LaneTag> bytes;
  const hn::RepartitionToWide<LaneTag> wide;
  HWY_ALIGN static constexpr std::uint8_t kPick[16] = {0, 1, 2, 3, 10, 11, 12, 13,
                                                       0, 1, 2, 3, 10, 11, 12, 13};
  const auto pick = hn::LoadDup128(bytes, kPick);
  const auto at = [&](std::size_t i) HWY_ATTR { return layer + offset[i]; };
  const auto row = [&](std::size_t j) HWY_ATTR {
    return hn::BitCast(d, hn::TableLookupBytes(hn::BitCast(bytes, load_row(at, j)), pick));
  };
  const auto r01 = hn::BitCast(wide, hn::InterleaveLower(d, row(0), row(1)));
  const auto r23 = hn::BitCast(wide, hn::InterleaveLower(d, row(2), row(3)));
  low = hn::BitCast(d, hn::InterleaveLower(wide, r01, r23));
  high = hn::BitCast(d, hn::InterleaveUpper(wide, r01, r23));
}

#endif

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
