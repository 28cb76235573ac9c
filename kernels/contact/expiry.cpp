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

std::size_t expired_simd(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float now, std::uint32_t* out) {
  const DF d;
  const DI di;
  const auto iota = hn::Iota(di, 0);
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * (blocks != nullptr ? blocks[k] : k);
    for (std::size_t i = first; i < first + kBlock; i += hn::Lanes(d)) {
      const auto gone = hn::Le(hn::LoadU(d, values + i), hn::Set(d, now));
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

HWY_EXPORT(expired_simd);
HWY_EXPORT(least_of_blocks_simd);

std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count, float now,
                    std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(expired_simd)(values, blocks, count, now, out);
}

void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out) {
  HWY_DYNAMIC_DISPATCH(least_of_blocks_simd)(values, blocks, count, out);
}

}  // namespace h6::kernels
#endif
