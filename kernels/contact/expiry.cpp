// SPDX-License-Identifier: Apache-2.0
// expiry.cpp - the SIMD twin of expiry_ref.cpp.
#include "kernels/contact/expiry.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/contact/expiry.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"

#include "kernels/compress-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kBlock>;
using DI = hn::RebindToSigned<DF>;

std::size_t travel_simd(const SpheresView& blocks, const Motion& motion, const float* expiry,
                        float margin, float* way, float* now, float* from, std::uint32_t* out) {
  const DF d;
  const DI di;
  const auto iota = hn::Iota(di, 0);
  std::size_t written = 0;
  for (std::size_t b = 0; b < blocks.count; b += hn::Lanes(d)) {
    const auto at = [&](const float* column) HWY_ATTR { return hn::LoadU(d, column + b); };
    const auto x = at(blocks.x), y = at(blocks.y), z = at(blocks.z);
    auto square = hn::Zero(d);
    for (const float* m : motion.change.m) {
      const auto last = hn::MulAdd(hn::Set(d, m[2]), z, hn::Set(d, m[3]));
      const auto moved = hn::MulAdd(hn::Set(d, m[0]), x, hn::MulAdd(hn::Set(d, m[1]), y, last));
      square = hn::MulAdd(moved, moved, square);
    }
    const auto beside =
        hn::MulAdd(hn::Set(d, motion.turn), at(blocks.radius), hn::Set(d, motion.more));
    const auto a = hn::Min(hn::Set(d, motion.most), hn::Add(hn::Sqrt(square), beside));
    auto there = hn::Add(at(way), a), back = hn::Sub(at(way), a);
    if (motion.settles) {
      there = back = hn::MulAdd(there, hn::Set(d, kRoundUp), there);
      hn::StoreU(there, d, way + b);
    }
    hn::StoreU(there, d, now + b);
    hn::StoreU(back, d, from + b);
    const auto gone = hn::Le(at(expiry), hn::Add(there, hn::Set(d, margin)));
    const auto index = hn::Add(iota, hn::Set(di, static_cast<std::int32_t>(b)));
    hn::StoreU(compress(di, index, hn::RebindMask(di, gone)), di,
               reinterpret_cast<std::int32_t*>(out + written));
    written += hn::CountTrue(d, gone);
  }
  return written;
}

std::size_t expired_simd(const float* values, const std::uint32_t* blocks, std::size_t count,
                         const float* now, float margin, std::uint32_t* out) {
  const DF d;
  const DI di;
  const auto iota = hn::Iota(di, 0);
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * blocks[k];
    const auto far = hn::Set(d, now[blocks[k]] + margin);
    for (std::size_t i = first; i < first + kBlock; i += hn::Lanes(d)) {
      const auto gone = hn::Le(hn::LoadU(d, values + i), far);
      const std::size_t n = hn::CountTrue(d, gone);
      if (n == 0) continue;
      const auto index = hn::Add(iota, hn::Set(di, static_cast<std::int32_t>(i)));
      hn::StoreU(compress(di, index, hn::RebindMask(di, gone)), di,
                 reinterpret_cast<std::int32_t*>(out + written));
      written += n;
    }
  }
  return written;
}

void least_of_blocks_simd(const float* values, const std::uint32_t* blocks, std::size_t count,
                          float* out) {
  const DF d;
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    auto least = hn::LoadU(d, first);
    for (std::size_t i = hn::Lanes(d); i < kBlock; i += hn::Lanes(d))
      least = hn::Min(least, hn::LoadU(d, first + i));
    out[blocks[k]] = hn::GetLane(hn::MinOfLanes(d, least));
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(travel_simd);
HWY_EXPORT(expired_simd);
HWY_EXPORT(least_of_blocks_simd);

std::size_t travel_blocks(const SpheresView& blocks, const Motion& motion, const float* expiry,
                          float margin, float* way, float* now, float* from, std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(travel_simd)(blocks, motion, expiry, margin, way, now, from, out);
}

std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count,
                    const float* now, float margin, std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(expired_simd)(values, blocks, count, now, margin, out);
}

void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out) {
  HWY_DYNAMIC_DISPATCH(least_of_blocks_simd)(values, blocks, count, out);
}

}  // namespace h6::kernels
#endif
