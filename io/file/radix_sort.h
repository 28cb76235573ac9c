// SPDX-License-Identifier: Apache-2.0
// radix_sort.h - sorts many 64-bit keys in linear time. The sort is stable, so its result depends
// neither on the machine nor on the number of threads.
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

// Ascending by key. `spare` is scratch space of any size. After the pulse stopped, the items are of
// no use: some may be missing.
void radix_sort(KeyedIndices& items, KeyedIndices& spare, unsigned threads = 1,
                Pulse* pulse = nullptr);

}  // namespace h6::io
