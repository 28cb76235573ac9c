// The resident helper takes slices, each once, and never holds the haptic thread up.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>
#include <vector>

#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/parallel_for.h"

using namespace h6::sched;

TEST_CASE("every slice runs exactly once, whoever takes it, job after job") {
  for (const unsigned threads : {1u, 2u}) {
    FrameTeam team(threads);
    CHECK(team.threads() == threads);
    std::vector<std::atomic<int>> ran(97);
    long wrong = 0;
    for (int frame = 0; frame < 3000; ++frame) {
      team.begin_frame();
      for (const std::size_t slices :
           {std::size_t{97}, std::size_t{2}, std::size_t{0}, std::size_t{1}}) {
        for (auto& r : ran) r.store(0, std::memory_order_relaxed);
        team.for_slices(slices,
                        [&](std::size_t i) { ran[i].fetch_add(1, std::memory_order_relaxed); });
        for (std::size_t i = 0; i < ran.size(); ++i) wrong += ran[i].load() != (i < slices ? 1 : 0);
      }
      team.end_frame(0);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("the helper does help") {
  FrameTeam team(2);
  std::set<std::thread::id> seen;
  std::mutex mutex;
  for (int frame = 0; frame < 200 && seen.size() < 2; ++frame) {
    team.begin_frame();
    team.for_slices(8, [&](std::size_t) {
      const std::int64_t end = now_ns() + 300000;
      while (now_ns() < end) {
      }
      std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
    team.end_frame(now_ns() + 100000);
  }
  CHECK(seen.size() == 2);
}

TEST_CASE("a team that nobody steps can be destroyed at once") {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 5; ++i) {
    FrameTeam team(2);
    team.begin_frame();
    team.end_frame(now_ns() + 3600000000000);  // the next frame is an hour away
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(5));
}

TEST_CASE("parallel_for visits every index once on any number of threads") {
  for (const unsigned threads : {0u, 1u, 2u, 5u}) {
    std::vector<std::atomic<int>> seen(1001);
    parallel_for(seen.size(), threads, [&](std::size_t i) { ++seen[i]; });
    for (const auto& s : seen) REQUIRE(s == 1);
    parallel_for(0, threads, [&](std::size_t) { FAIL("nothing to visit"); });
  }
  CHECK(machine_threads() >= 1);
}
