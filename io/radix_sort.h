// radix_sort.h - the order of many 64-bit keys, in linear time: equal keys keep their order, so a
// sort never depends on the machine or on the number of threads.
#pragma once
#include <cstdint>
#include <vector>

namespace h6::io {

struct KeyedIndex {
  std::uint64_t key;
  std::uint32_t index;
};

// Ascending by key, stable. `spare` is scratch space of any size.
void radix_sort(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& spare);

}  // namespace h6::io
