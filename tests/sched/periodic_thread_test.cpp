// SPDX-License-Identifier: Apache-2.0
// Deadlines are absolute, late frames have one cause, denormals are flushed only in scope.
#include <doctest/doctest.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/periodic_thread.h"
#include "sched/wake_ahead.h"

using namespace h6::sched;

TEST_CASE("ticks are numbered from 0 without a gap and end when the work says so") {
  for (const bool virtual_time : {true, false}) {
    std::vector<std::uint64_t> ticks, done;
    PeriodicThreadOptions options;
    options.virtual_time = virtual_time;
    options.rate = 5000;
    PeriodicThread thread(options,
                          {nullptr,
                           [&](std::uint64_t n, const TickTiming&, double) {
                             ticks.push_back(n);
                             return n < 99;
                           },
                           [&](std::uint64_t n, const TickTiming&) { done.push_back(n); }});
    thread.join();
    CHECK(!thread.running());
    REQUIRE(ticks.size() == 100);
    CHECK(ticks.back() == 99);
    CHECK(done == ticks);
  }
}

TEST_CASE("a frame never starts before its deadline") {
  double earliest = 1e9;
  PeriodicThreadOptions options;
  options.spin_us = 100;
  PeriodicThread thread(options, {nullptr,
                                  [&](std::uint64_t n, const TickTiming&, double wakeup_us) {
                                    if (wakeup_us < earliest) earliest = wakeup_us;
                                    return n < 100;
                                  },
                                  nullptr});
  thread.join();
  CHECK(earliest >= 0);
}

TEST_CASE(
    "sleep ends early by what the machine takes to wake a sleeper, as far as the spin is long") {
  std::mt19937 random(1);
  for (const double usual : {20e3, 45e3, 94e3, 300e3}) {
    // Every hundredth sleep ends 5 ms late, as if the time were stolen.
    std::lognormal_distribution<double> late(std::log(usual), 0.3);
    WakeAhead ahead(1000000, 100000);
    std::int64_t deadline = 0;
    int whole = 0;
    for (int i = 0; i < 4000; ++i) {
      const std::int64_t now = deadline += 1000000, next = deadline + 1000000;
      const std::int64_t aim = ahead.aim(now, next);
      CHECK(aim > now);
      CHECK(aim <= next - 100000);
      CHECK(aim >= next - 200000);
      const std::int64_t woken =
          aim + (i % 100 == 99 ? 5000000 : static_cast<std::int64_t>(late(random)));
      ahead.learn(aim, woken);
      if (i >= 1000) whole += woken <= next - 100000;
    }
    CAPTURE(usual);
    if (usual < 100e3)
      CHECK(std::abs(whole - 1500) < 150);
    else
      CHECK(ahead.early() == 100000);
  }
}

TEST_CASE("deadlines are a period apart, and the kernel's tick comes before their spin") {
  for (const std::int64_t period : {100000, 250000, 500000, 1000000, 10000000})
    for (const std::int64_t spin : {0, 50000, 100000, 180000}) {
      const WakeAhead ahead(period, spin);
      for (std::int64_t time = 7; time < 40000000; time += 999983) {
        const std::int64_t deadline = ahead.place(time);
        CHECK(deadline >= time);
        CHECK(deadline < time + period);
        CHECK(ahead.place(deadline) == deadline);
        CHECK(ahead.place(deadline + 1) == deadline + period);
        if (spin + 50000 < period) CHECK((deadline - spin - 50000) % period == 0);
      }
    }
}

TEST_CASE("a thread that polls before its deadlines also sleeps, but never into the spin") {
  WakeAhead ahead(250000, 100000);
  for (int i = 0; i < 1000; ++i) ahead.learn(0, 200000);
  for (std::int64_t now = 0; now < 250000; now += 1000) {
    const std::int64_t aim = ahead.aim(now, 250000);
    CHECK(aim <= std::max<std::int64_t>(now, 150000));
    if (now < 130000) CHECK(aim >= now + 250000 / 16);
  }
  // Without a spin the sleep ends at the deadline, however late the thread is woken.
  WakeAhead plain(250000, 0);
  for (int i = 0; i < 1000; ++i) plain.learn(0, 200000);
  CHECK(plain.aim(0, 250000) == 250000);
}

TEST_CASE("a frame that computes too long is late by its own computation; one that sleeps is not") {
  int compute = 0, stolen = 0;
  PeriodicThreadOptions options;
  options.rate = 200;  // 5 ms
  PeriodicThread thread(options,
                        {nullptr,
                         [&](std::uint64_t n, const TickTiming&, double) {
                           const std::int64_t until = now_ns() + 8000000;
                           if (n == 3) {
                             const std::int64_t cpu = thread_cpu_ns() + 7000000;
                             while (thread_cpu_ns() < cpu) {
                             }
                           }
                           if (n == 6)
                             sleep_until_ns(until);  // as if the machine ran something else
                           return n < 9;
                         },
                         [&](std::uint64_t n, const TickTiming& t) {
                           if (n == 3) compute += t.late == Late::compute;
                           if (n == 6) stolen += t.late == Late::stolen;
                         }});
  thread.join();
  CHECK(compute == 1);
  CHECK(stolen == 1);
}

TEST_CASE("a frame that waits for a helper's slice is not late by its own computation") {
  FrameTeam team(2);
  std::atomic<bool> taken{false};
  int late[4] = {};
  bool helped = false;
  PeriodicThreadOptions options;
  options.rate = 200;  // 5 ms
  PeriodicThread thread(
      options, {nullptr,
                [&](std::uint64_t n, const TickTiming&, double) {
                  team.begin_frame(now_ns());
                  taken = false;
                  team.for_slices(2, [&](std::size_t slice) {
                    if (slice == 1) taken = true;
                    if (slice == 1 && FrameTeam::here()) sleep_until_ns(now_ns() + 8000000);
                    const std::int64_t give_up = now_ns() + 2000000;
                    while (slice == 0 && !taken && now_ns() < give_up) {
                    }
                    if (FrameTeam::here()) helped = true;
                  });
                  team.end_frame(now_ns() + 5000000);
                  return n < 20000 && !(helped && n > 0);
                },
                [&](std::uint64_t, const TickTiming& t) { ++late[static_cast<int>(t.late)]; }});
  thread.join();
  CHECK(helped);
  CHECK(late[static_cast<int>(Late::compute)] == 0);
  CHECK(late[static_cast<int>(Late::stolen)] > 0);
}

TEST_CASE("after a long stall the schedule moves on instead of catching up") {
  std::vector<std::int64_t> starts;
  PeriodicThreadOptions options;
  options.rate = 1000;
  PeriodicThread thread(options, {nullptr,
                                  [&](std::uint64_t n, const TickTiming&, double) {
                                    starts.push_back(now_ns());
                                    if (n == 5) sleep_until_ns(now_ns() + 50000000);
                                    return n < 20;
                                  },
                                  nullptr});
  thread.join();
  // 14 frames follow the stall, at their own rate and not in one burst.
  CHECK(starts[20] - starts[6] > 10 * 1000000);
}

TEST_CASE("the granted real-time support is described in words") {
  RealtimeGrant grant;
  PeriodicThreadOptions options;
  PeriodicThread thread(options,
                        {[&](const RealtimeGrant& g) { grant = g; },
                         [](std::uint64_t, const TickTiming&, double) { return false; }, nullptr});
  thread.join();
  const std::string text = grant.text;
  CHECK(text.find("core") != std::string::npos);
  CHECK(text.find("SCHED_FIFO") != std::string::npos);
  CHECK(text.find("memory") != std::string::npos);
  if (!grant.fifo) CHECK(text.find("limits.conf") != std::string::npos);
}

TEST_CASE("the core is one that taskset leaves, and another one is not taken") {
  cpu_set_t before, one;
  REQUIRE(pthread_getaffinity_np(pthread_self(), sizeof before, &before) == 0);
  int first = 0;
  while (!CPU_ISSET(first, &before)) ++first;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  REQUIRE(pthread_setaffinity_np(pthread_self(), sizeof one, &one) == 0);  // threads inherit it
  for (const int asked : {-1, first, first + 1}) {
    RealtimeGrant grant;
    PeriodicThreadOptions options;
    options.request.core = asked;
    PeriodicThread thread(
        options, {[&](const RealtimeGrant& g) { grant = g; },
                  [](std::uint64_t, const TickTiming&, double) { return false; }, nullptr});
    thread.join();
    CHECK(grant.core == (asked > first ? -1 : first));
    if (asked > first) CHECK(std::string(grant.text).find("taskset") != std::string::npos);
  }
  REQUIRE(pthread_setaffinity_np(pthread_self(), sizeof before, &before) == 0);
}

TEST_CASE("denormals are zero in scope and unchanged after it") {
  volatile double tiny = std::numeric_limits<double>::min();
  {
    const FlushDenormals flush;
    volatile double half = tiny * 0.5;
    CHECK(half == 0);
  }
  volatile double half = tiny * 0.5;
  std::uint64_t bits;
  const double value = half;
  std::memcpy(&bits, &value, sizeof bits);
  CHECK(bits != 0);
}
