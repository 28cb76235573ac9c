// SPDX-License-Identifier: Apache-2.0
// content_hash_test.cpp - the fingerprint is XXH3's, so that other programs can compute it.
#include <doctest/doctest.h>

#include <set>
#include <string>

#include "io/file/content_hash.h"

using namespace h6::io;

TEST_CASE("the fingerprint is the published one and sees every byte") {
  const std::string fox = "The quick brown fox jumps over the lazy dog";
  CHECK(hex(hash_bytes(fox.data(), fox.size())) == "ddd650205ca3e7fa24a1cc2e3a8a7651");
  CHECK(hex(hash_bytes("", 0)) == "99aa06d3014798d86001c324468d497f");
  std::set<std::string> seen;
  std::string bytes(67, '\0');
  for (std::size_t size = 0; size <= bytes.size(); ++size)
    seen.insert(hex(hash_bytes(bytes.data(), size)));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= char(1u << bit % 8);
    seen.insert(hex(hash_bytes(bytes.data(), bytes.size())));
    bytes[bit / 8] ^= char(1u << bit % 8);
  }
  CHECK(seen.size() == 68 + 8 * 67);
}
