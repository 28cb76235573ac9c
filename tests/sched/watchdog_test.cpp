// SPDX-License-Identifier: Apache-2.0
// A watchdog acts if and only if the watched thread gives no sign of life.
#include <doctest/doctest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "sched/clock.h"
#include "sched/halt_list.h"
#include "sched/watchdog.h"

using namespace h6::sched;

namespace {

constexpr std::int64_t kMillisecond = 1000000;

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

// Waits until the condition holds, or far too long has passed.
template <class F>
bool soon(F&& holds) {
  for (int i = 0; i < 60000 && !holds(); ++i) pause_ms(1);
  return holds();
}

}  // namespace

TEST_CASE("without a beat nothing expires; when beats stop it expires again and again") {
  std::atomic<int> expired{0};
  Watchdog dog(5 * kMillisecond, 0, [&] { ++expired; });
  pause_ms(50);
  CHECK(expired == 0);
  CHECK(dog.trips() == 0);
  dog.beat(now_ns());
  CHECK(soon([&] { return expired >= 3; }));
  CHECK(dog.trips() == 1);
  dog.beat(now_ns());
  CHECK(soon([&] { return dog.trips() == 2; }));
  dog.rest();
  pause_ms(20);  // one call may be running
  const int then = expired;
  pause_ms(50);
  CHECK(expired == then);
}

TEST_CASE("beats in time keep the watchdog quiet") {
  std::atomic<int> expired{0};
  Watchdog dog(60000 * kMillisecond, 0, [&] { ++expired; });
  for (int i = 0; i < 100; ++i) {
    dog.beat(now_ns());
    pause_ms(1);
  }
  CHECK(expired == 0);
}

TEST_CASE("a watchdog that sleeps ends at once") {
  const auto start = std::chrono::steady_clock::now();
  {
    Watchdog dog(60000 * kMillisecond, 0, [] {});
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(50));
}

TEST_CASE("a list halts all its entries, none that was removed, and refuses more when full") {
  std::atomic<int> halts[kMostToHalt + 1] = {};
  const auto halt = [](void* self) { ++*static_cast<std::atomic<int>*>(self); };
  for (std::size_t i = 0; i < kMostToHalt; ++i) CHECK(add_to_halt_list(halt, &halts[i]));
  CHECK(!add_to_halt_list(halt, &halts[kMostToHalt]));
  remove_from_halt_list(&halts[3]);
  halt_all();
  halt_all();
  for (std::size_t i = 0; i <= kMostToHalt; ++i)
    CHECK(halts[i] == (i == 3 || i == kMostToHalt ? 0 : 2));
  for (std::size_t i = 0; i < kMostToHalt; ++i) remove_from_halt_list(&halts[i]);
  halt_all();
  CHECK(halts[0] == 2);
}

TEST_CASE("exit halts the entries of the process, and none of its parent's") {
  int pipe_ends[2];
  REQUIRE(pipe(pipe_ends) == 0);
  struct Voice {
    int to;
    char word;
  } parent{pipe_ends[1], 'p'}, child{pipe_ends[1], 'c'};
  const auto speak = [](void* self) {
    const auto& v = *static_cast<Voice*>(self);
    if (write(v.to, &v.word, 1) != 1) std::abort();
  };
  REQUIRE(add_to_halt_list(speak, &parent));
  std::fflush(nullptr);  // otherwise the child prints it again
  const pid_t pid = fork();
  REQUIRE(pid >= 0);
  if (pid == 0) {
    if (!add_to_halt_list(speak, &child)) _exit(1);
    std::exit(0);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  CHECK(WIFEXITED(status));
  remove_from_halt_list(&parent);
  close(pipe_ends[1]);
  char heard[8] = {};
  CHECK(read(pipe_ends[0], heard, sizeof heard) == 1);
  CHECK(heard[0] == 'c');
  close(pipe_ends[0]);
}
