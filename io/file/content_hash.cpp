// SPDX-License-Identifier: Apache-2.0
#include "io/file/content_hash.h"

#include <xxhash.h>

namespace h6::io {

Hash128 hash_bytes(const void* bytes, std::size_t size) {
  const XXH128_hash_t hash = XXH3_128bits(bytes, size);
  return {hash.low64, hash.high64};
}

std::uint64_t hash_on(std::uint64_t before, const void* bytes, std::size_t size) {
  return XXH3_64bits_withSeed(bytes, size, before);
}

std::string hex(const Hash128& hash) {
  std::string text;
  for (const std::uint64_t half : {hash.high, hash.low})
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[(half >> shift) & 15];
  return text;
}

}  // namespace h6::io
