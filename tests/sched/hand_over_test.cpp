// SPDX-License-Identifier: Apache-2.0
// Values pass from a thread that must not wait to a thread that may be slow.
#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <thread>

#include "sched/latest_value.h"
#include "sched/spsc_ring.h"

using namespace h6::sched;

namespace {
// Large enough that a torn copy would show.
struct Wide {
  std::array<std::uint64_t, 32> v{};
  static Wide of(std::uint64_t n) {
    Wide w;
    w.v.fill(n);
    return w;
  }
  bool whole() const {
    for (const std::uint64_t x : v)
      if (x != v[0]) return false;
    return true;
  }
};
}  // namespace

TEST_CASE("a ring keeps order, shows the oldest value and refuses values when full") {
  int slots[4];
  SpscRing<int> ring(slots, 4);
  for (int i = 0; i < 6; ++i) CHECK(ring.push(i) == (i < 4));
  CHECK_FALSE(ring.room_for(1));
  CHECK(*ring.front() == 0);
  int out[8];
  CHECK(ring.pop(out, 3) == 3);
  CHECK(out[2] == 2);
  CHECK(ring.push(9));
  CHECK(ring.pop(out, 8) == 2);
  CHECK(out[0] == 3);
  CHECK(out[1] == 9);
  CHECK(ring.pop(out, 8) == 0);
  CHECK(ring.front() == nullptr);
  CHECK(ring.room_for(4));
  CHECK_FALSE(ring.room_for(5));
}

TEST_CASE("a ring between two threads loses, repeats and tears nothing") {
  std::array<Wide, 64> slots;
  SpscRing<Wide> ring(slots.data(), slots.size());
  constexpr std::uint64_t count = 200000;
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < count; ++i)
      while (!ring.push(Wide::of(i))) std::this_thread::yield();
  });
  std::array<Wide, 16> some;
  std::uint64_t next = 0;
  bool good = true;
  while (next < count) {
    const std::size_t n = ring.pop(some.data(), some.size());
    for (std::size_t i = 0; i < n; ++i) good = good && some[i].whole() && some[i].v[0] == next++;
    if (n == 0) std::this_thread::yield();
  }
  writer.join();
  CHECK(good);
}

TEST_CASE("the latest value is the newest one, complete, and given only once") {
  LatestValue<int> box;
  int out = -1;
  CHECK(!box.take(out));
  box.publish(1);
  box.publish(2);
  CHECK(box.take(out));
  CHECK(out == 2);
  CHECK(!box.take(out));
}

TEST_CASE("the latest value between two threads never goes back and never tears") {
  LatestValue<Wide> box;
  constexpr std::uint64_t count = 300000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= count; ++i) box.publish(Wide::of(i));
  });
  std::uint64_t last = 0;
  bool good = true;
  while (last < count) {
    Wide w;
    if (!box.take(w)) {
      std::this_thread::yield();
      continue;
    }
    good = good && w.whole() && w.v[0] > last;
    last = w.v[0];
  }
  writer.join();
  CHECK(good);
}
