// SPDX-License-Identifier: Apache-2.0
// radix_sort.cpp - least significant digit first, 11 bits a round. A round is skipped when its
// digit is the same in all keys. Blocks count and move their items in parallel; the counts of all
// blocks give each block the places of its items, so the order does not depend on which moves
// first.
#include "io/file/radix_sort.h"

#include <algorithm>
#include <array>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr int digit_bits = 11, rounds = 6;
constexpr std::size_t digits = std::size_t{1} << digit_bits;
constexpr std::size_t block_size = std::size_t{1} << 16;
using Table = std::array<std::uint32_t, digits>;

// The bits in which some key differs from the first.
std::uint64_t varying_bits(const KeyedIndices& items) {
  std::uint64_t varying = 0;
  for (const KeyedIndex& item : items) varying |= item.key ^ items[0].key;
  return varying;
}

// Turns counts into the place of the first item of each digit in each block.
void place_digits(std::vector<Table>& tables) {
  std::uint32_t next = 0;
  for (std::size_t digit = 0; digit < digits; ++digit) {
    for (Table& table : tables) {
      const std::uint32_t count = table[digit];
      table[digit] = next;
      next += count;
    }
  }
}

}  // namespace

void radix_sort(KeyedIndices& items, KeyedIndices& spare, unsigned threads, Pulse* pulse) {
  if (items.empty()) return;
  const std::uint64_t varying = varying_bits(items);
  spare.resize(items.size());
  const std::size_t blocks = (items.size() + block_size - 1) / block_size;
  std::vector<Table> tables(blocks);
  for (int round = 0; round < rounds; ++round) {
    const int shift = round * digit_bits;
    if ((varying >> shift) % digits == 0) continue;
    const auto each = [&](const auto& body) {
      sched::parallel_for(blocks, threads, [&](std::size_t b) {
        if (!alive(pulse)) return;
        body(tables[b], items.data() + b * block_size,
             items.data() + std::min(items.size(), (b + 1) * block_size));
      });
    };
    each([&](Table& table, const KeyedIndex* from, const KeyedIndex* to) {
      table.fill(0);
      for (; from != to; ++from) ++table[(from->key >> shift) % digits];
    });
    if (!alive(pulse)) return;
    place_digits(tables);
    each([&](Table& table, const KeyedIndex* from, const KeyedIndex* to) {
      for (; from != to; ++from) spare[table[(from->key >> shift) % digits]++] = *from;
    });
    if (!alive(pulse)) return;
    items.swap(spare);
  }
}

}  // namespace h6::io
