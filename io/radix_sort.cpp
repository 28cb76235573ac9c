// radix_sort.cpp - least significant digit first, 11 bits a round; digits that are the same in all
// keys cost one look at a table and no move.
#include "io/radix_sort.h"

#include <array>

namespace h6::io {

void radix_sort(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& spare) {
  constexpr int digit_bits = 11, rounds = 6;
  constexpr std::uint64_t mask = (1u << digit_bits) - 1;
  std::vector<std::array<std::size_t, mask + 1>> counts(rounds);
  for (auto& table : counts) table.fill(0);
  for (const KeyedIndex& item : items) {
    for (int round = 0; round < rounds; ++round) {
      ++counts[round][(item.key >> (round * digit_bits)) & mask];
    }
  }
  spare.resize(items.size());
  for (int round = 0; round < rounds; ++round) {
    const int shift = round * digit_bits;
    auto& table = counts[round];
    if (items.empty() || table[(items[0].key >> shift) & mask] == items.size()) continue;
    std::size_t first = 0;
    for (std::size_t& entry : table) {
      const std::size_t count = entry;
      entry = first;
      first += count;
    }
    for (const KeyedIndex& item : items) spare[table[(item.key >> shift) & mask]++] = item;
    items.swap(spare);
  }
}

}  // namespace h6::io
