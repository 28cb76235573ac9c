// SPDX-License-Identifier: Apache-2.0
#include "io/file/content_hash.h"

#include <bit>
#include <cstring>

namespace h6::io {
namespace {

constexpr std::uint64_t c1 = 0x87C37B91114253D5u, c2 = 0x4CF5AD432745937Fu;

std::uint64_t stir_low(std::uint64_t word) { return std::rotl(word * c1, 31) * c2; }
std::uint64_t stir_high(std::uint64_t word) { return std::rotl(word * c2, 33) * c1; }

std::uint64_t avalanche(std::uint64_t h) {
  h = (h ^ (h >> 33)) * 0xFF51AFD7ED558CCDu;
  h = (h ^ (h >> 33)) * 0xC4CEB9FE1A85EC53u;
  return h ^ (h >> 33);
}

}  // namespace

Hash128 hash_bytes(const void* bytes, std::size_t size) {
  static_assert(std::endian::native == std::endian::little);
  const char* at = static_cast<const char*>(bytes);
  Hash128 h;
  std::size_t left = size;
  for (; left >= 16; left -= 16, at += 16) {
    std::uint64_t word[2];
    std::memcpy(word, at, 16);
    h.low = (std::rotl(h.low ^ stir_low(word[0]), 27) + h.high) * 5 + 0x52DCE729u;
    h.high = (std::rotl(h.high ^ stir_high(word[1]), 31) + h.low) * 5 + 0x38495AB5u;
  }
  std::uint64_t tail[2] = {0, 0};
  if (left > 0) std::memcpy(tail, at, left);
  h.low ^= stir_low(tail[0]) ^ size;
  h.high ^= stir_high(tail[1]) ^ size;
  h.low += h.high;
  h.high += h.low;
  h.low = avalanche(h.low);
  h.high = avalanche(h.high);
  h.low += h.high;
  h.high += h.low;
  return h;
}

std::string hex(const Hash128& hash) {
  std::string text;
  for (const std::uint64_t half : {hash.low, hash.high}) {
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[(half >> shift) & 15];
  }
  return text;
}

}  // namespace h6::io
