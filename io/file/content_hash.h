// SPDX-License-Identifier: Apache-2.0
// content_hash.h - a 128-bit fingerprint of bytes.
//
// MurmurHash3, x64, 128 bits (A. Appleby), from its description: no package of ours has a fast
// 128-bit hash, it runs at gigabytes a second, and two different meshes meet by chance once in
// 2^64. It does not resist an attacker; a cache on one's own disk need not.
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
std::string hex(const Hash128& hash);  // 32 digits

}  // namespace h6::io
