// SPDX-License-Identifier: Apache-2.0
// clock_test.cpp - the length of a tick, also after jumps of the counter or the clock.
#include "sched/clock.h"
#include <doctest/doctest.h>

using namespace h6::sched;

TEST_CASE("a tick is as long as the clock advanced per tick, from the second reading on") {
  TickLength length;
  length.see(1000, 7000);
  length.see(1500, 8000);
  CHECK(length.ns() == 0.5);
  // A longer span is more accurate, up to a second.
  length.see(3000, 12000);
  CHECK(length.ns() == 0.4);
}

TEST_CASE("after a second the length of a tick stays for a second, then follows the next one") {
  constexpr std::int64_t kSecond = 1000000000;
  TickLength length;
  length.see(10, 20);
  length.see(2 * kSecond + 10, kSecond + 20);
  CHECK(length.ns() == 2);
  length.see(2 * kSecond + 1000, 5 * kSecond);
  CHECK(length.ns() == 2);
  // A jump is forgotten.
  length.see(4 * kSecond + 10, 9 * kSecond + 20);
  length.see(6 * kSecond + 10, 10 * kSecond + 20);
  CHECK(length.ns() == 2);
  // A counter that was set back starts anew.
  length.see(6 * kSecond + 50, 30);
  length.see(9 * kSecond + 50, kSecond + 30);
  CHECK(length.ns() == 3);
}

TEST_CASE("ticks never go back in one thread") {
  std::int64_t last = ticks();
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t next = ticks();
    REQUIRE(next >= last);
    last = next;
  }
}
