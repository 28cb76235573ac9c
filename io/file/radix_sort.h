// SPDX-License-Identifier: Apache-2.0
// radix_sort.h - the order of many 64-bit keys, in linear time: equal keys keep their order, so a
// sort never depends on the machine or on the number of threads.
#pragma once
#include <cstdint>

#include "io/file/pulse.h"
#include "io/file/raw_vector.h"

namespace h6::io {

struct KeyedIndex {
  std::uint64_t key;
  std::uint32_t index;
};
using KeyedIndices = RawVector<KeyedIndex>;

// Ascending by key, stable. `spare` is scratch space of any size. When the pulse stops, the items
// are left in some order, not all of them.
void radix_sort(KeyedIndices& items, KeyedIndices& spare, unsigned threads = 1,
                Pulse* pulse = nullptr);

}  // namespace h6::io
