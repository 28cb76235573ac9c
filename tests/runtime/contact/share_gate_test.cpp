// SPDX-License-Identifier: Apache-2.0
// Work is shared exactly where that takes less time.
#include <doctest/doctest.h>

#include <cstddef>

#include "runtime/contact/share_gate.h"

namespace {

// How many of `times` jobs are shared when an item takes `shared` ns shared and `alone` ns alone.
int shared_of(h6::ShareGate& gate, int times, std::size_t size, double alone, double shared,
              int stolen = 0) {
  int count = 0;
  for (int i = 0; i < times; ++i) {
    const bool share = gate.share(size);
    count += share;
    const double robbed = stolen && i % stolen == 0 ? 1e6 : 0;
    gate.took(static_cast<double>(size) * (share ? shared : alone) + robbed);
  }
  return count;
}

}  // namespace

TEST_CASE("work is shared where that is faster, and not where it is slower") {
  for (const std::size_t size : {300, 1000, 5000, 100000000}) {
    h6::ShareGate pays, costs;
    CHECK(shared_of(pays, 10000, size, 20, 15) > 9700);
    CHECK(shared_of(costs, 10000, size, 20, 25) < 300);
  }
}

TEST_CASE("work of less than three microseconds is not shared, even if that seemed faster") {
  h6::ShareGate gate;
  CHECK(shared_of(gate, 10000, 100, 20, 1) < 20);
  // It may grow.
  CHECK(shared_of(gate, 10000, 100, 60, 40) > 9500);
}

TEST_CASE("each size is judged for itself") {
  h6::ShareGate gate;
  int small = 0, large = 0;
  for (int i = 0; i < 5000; ++i) {
    small += shared_of(gate, 1, 600, 10, 30);
    large += shared_of(gate, 1, 10000, 30, 17);
  }
  CHECK(small < 200);
  CHECK(large > 4800);
}

TEST_CASE("a change of the machine is noticed within some thousand jobs") {
  h6::ShareGate gate;
  shared_of(gate, 5000, 1000, 25, 17);
  shared_of(gate, 5000, 1000, 18, 27);
  CHECK(shared_of(gate, 5000, 1000, 18, 27) < 200);
  shared_of(gate, 10000, 1000, 25, 17);
  CHECK(shared_of(gate, 5000, 1000, 25, 17) > 4700);
}

TEST_CASE("a stolen millisecond now and then does not decide") {
  h6::ShareGate gate;
  CHECK(shared_of(gate, 20000, 1000, 20, 14, 333) > 18500);
  h6::ShareGate other;
  CHECK(shared_of(other, 20000, 1000, 14, 20, 333) < 1500);
}

TEST_CASE("a time without a question teaches nothing") {
  h6::ShareGate gate;
  for (int i = 0; i < 100; ++i) gate.took(1e9);
  CHECK(shared_of(gate, 10000, 1000, 20, 25) < 300);
}
