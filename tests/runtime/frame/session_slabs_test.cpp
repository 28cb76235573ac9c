// SPDX-License-Identifier: Apache-2.0
// session_slabs_test.cpp - sessions that come and go in any order never share memory.
#include "runtime/frame/session_slabs.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

TEST_CASE("pieces of slabs keep what is written to them, whatever is taken and given back beside") {
  struct Piece {
    unsigned char* memory;
    std::size_t bytes;
    unsigned char mark;
  };
  h6::SessionSlabs slabs;
  std::vector<Piece> pieces;
  std::mt19937_64 random(7);
  const std::size_t sizes[] = {1, 64, 100000, 106048, 3000001, 9 << 20};
  const auto whole = [](const Piece& p) {
    return std::all_of(p.memory, p.memory + p.bytes, [&](unsigned char c) { return c == p.mark; });
  };
  for (int i = 0; i < 300; ++i) {
    if (pieces.size() < 40 && random() % 5 < 3) {
      const std::size_t bytes = sizes[random() % std::size(sizes)];
      Piece p{static_cast<unsigned char*>(slabs.take(bytes)), bytes,
              static_cast<unsigned char>(random())};
      REQUIRE(p.memory != nullptr);
      CHECK(reinterpret_cast<std::uintptr_t>(p.memory) % h6::kAlignment == 0);
      std::memset(p.memory, p.mark, bytes);
      pieces.push_back(p);
    } else if (!pieces.empty()) {
      std::swap(pieces[random() % pieces.size()], pieces.back());
      CHECK(whole(pieces.back()));
      slabs.give_back(pieces.back().memory, pieces.back().bytes);
      pieces.pop_back();
    }
  }
  for (const Piece& p : pieces) {
    CHECK(whole(p));
    slabs.give_back(p.memory, p.bytes);
  }
}

TEST_CASE("pieces of one size lie side by side, and what was given back is taken again") {
  constexpr std::size_t kBytes = 106048;
  h6::SessionSlabs slabs;
  std::vector<std::uintptr_t> at;
  for (int i = 0; i < 64; ++i) at.push_back(reinterpret_cast<std::uintptr_t>(slabs.take(kBytes)));
  std::sort(at.begin(), at.end());
  CHECK(at.back() - at.front() == 63 * kBytes);
  slabs.give_back(reinterpret_cast<void*>(at[20]), kBytes);
  CHECK(reinterpret_cast<std::uintptr_t>(slabs.take(kBytes)) == at[20]);
  for (const std::uintptr_t p : at) slabs.give_back(reinterpret_cast<void*>(p), kBytes);
}

TEST_CASE("a slab holds two pieces of the largest size, and a larger one gets memory of its own") {
  constexpr std::size_t kHalf = 4 * h6::kHugePage;  // of a slab
  // The begin of a slab is no piece's, so memory on the limit of a huge page is no slab's.
  const auto alone = [](const void* p) {
    return reinterpret_cast<std::uintptr_t>(p) % h6::kHugePage == 0;
  };
  h6::SessionSlabs slabs;
  for (const std::size_t bytes : {kHalf - h6::kAlignment + 1, kHalf}) {
    void* const p = slabs.take(bytes);
    REQUIRE(p != nullptr);
    CHECK(alone(p));
    slabs.give_back(p, bytes);
  }
  const std::size_t most = kHalf - h6::kAlignment;
  char* const a = static_cast<char*>(slabs.take(most));
  char* const b = static_cast<char*>(slabs.take(most));
  REQUIRE((a != nullptr && b != nullptr));
  CHECK(!alone(a));
  CHECK(b - a == static_cast<std::ptrdiff_t>(most));
  slabs.give_back(a, most), slabs.give_back(b, most);
}
