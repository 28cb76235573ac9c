// SPDX-License-Identifier: Apache-2.0
// content_hash.h - a 128-bit fingerprint of bytes: XXH3 with seed 0.
//
// Two different meshes collide by chance once in 2^64 pairs. The hash does not resist an attacker;
// a cache on the user's own disk need not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

namespace h6::io {

struct Hash128 {
  std::uint64_t low = 0, high = 0;
  bool operator==(const Hash128&) const = default;
};

Hash128 hash_bytes(const void* bytes, std::size_t size);
// Continues a running hash: XXH3 with 64 bits, seeded with the hash before.
std::uint64_t hash_on(std::uint64_t before, const void* bytes, std::size_t size);
std::string hex(const Hash128& hash);  // 32 digits, the most significant first, as xxh128sum

}  // namespace h6::io
