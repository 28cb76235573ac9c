// SPDX-License-Identifier: Apache-2.0
// compress-inl.h - moves the lanes that a mask selects to the front, in order.
//
// Highway 1.0 keeps the tables for this inside the function, and compilers copy them to the stack
// at every call: hundreds of bytes for eight lanes. The tables here are static.
//
// Included once for each SIMD target.
#include <cstddef>
#include <cstdint>

#ifndef H6_KERNELS_COMPRESS_TABLES
#define H6_KERNELS_COMPRESS_TABLES
namespace h6::kernels {

// Indexed by the bits of the mask: the order of eight lanes; the order of the bytes of four lanes.
struct CompressTables {
  alignas(64) std::uint8_t lane[256][8];
  alignas(64) std::uint8_t byte[16][16];
};
constexpr CompressTables make_compress_tables() {
  CompressTables t{};
  for (unsigned bits = 0; bits < 256; ++bits) {
    unsigned n = 0;
    for (unsigned i = 0; i < 8; ++i)
      if (bits >> i & 1) t.lane[bits][n++] = std::uint8_t(i);
  }
  for (unsigned bits = 0; bits < 16; ++bits)
    for (unsigned i = 0; i < 16; ++i)
      t.byte[bits][i] = std::uint8_t(4 * t.lane[bits][i / 4] + i % 4);
  return t;
}
inline constexpr CompressTables kCompress = make_compress_tables();

}  // namespace h6::kernels
#endif

// Per-target include guard.
#if defined(H6_KERNELS_COMPRESS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_COMPRESS_INL_H_
#undef H6_KERNELS_COMPRESS_INL_H_
#else
#define H6_KERNELS_COMPRESS_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// For vectors of up to eight lanes of 32 bits: bit i of `bits` keeps lane i. The lanes after the
// kept ones are unspecified.
template <class D>
HWY_INLINE hn::Vec<D> compress_by_bits(D d, hn::Vec<D> v, std::uint32_t bits) {
#if HWY_TARGET != HWY_SCALAR && HWY_TARGET > HWY_AVX3
#if HWY_TARGET == HWY_AVX2
  if constexpr (hn::MaxLanes(D()) == 8) {
    const hn::RebindToSigned<D> di;
    const hn::Rebind<std::uint8_t, D> bytes;
    const auto lanes = hn::PromoteTo(di, hn::LoadU(bytes, kCompress.lane[bits]));
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, lanes));
  }
#endif
  if constexpr (hn::MaxLanes(D()) == 4) {
    const hn::Repartition<std::uint8_t, D> bytes;
    return hn::BitCast(
        d, hn::TableLookupBytes(hn::BitCast(bytes, v), hn::Load(bytes, kCompress.byte[bits])));
  }
#endif
  const std::uint8_t mask[8] = {std::uint8_t(bits)};
  return hn::Compress(v, hn::LoadMaskBits(d, mask));
}

template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0];
}

// The same with a mask.
template <class D>
HWY_INLINE hn::Vec<D> compress([[maybe_unused]] D d, hn::Vec<D> v, hn::Mask<D> mask) {
#if HWY_TARGET != HWY_SCALAR && HWY_TARGET > HWY_AVX3
  return compress_by_bits(d, v, bits_of(d, mask));
#else
  return hn::Compress(v, mask);
#endif
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
