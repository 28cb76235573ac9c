// SPDX-License-Identifier: Apache-2.0
// Helpers take slices, each once, and never delay the haptic thread.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/parallel_for.h"

using namespace h6::sched;

namespace {

// On a busy machine a helper may get no core for seconds, so tests wait for it: for two minutes.
class Patience {
 public:
  bool left() const { return now_ns() < end_; }

 private:
  std::int64_t end_ = now_ns() + 120'000'000'000;
};

// A program's own pool of threads, for tasks that come frame by frame.
class OwnPool {
 public:
  explicit OwnPool(unsigned threads) {
    for (unsigned i = 0; i < threads; ++i) workers_.emplace_back([this] { work(); });
  }
  ~OwnPool() {
    {
      std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    for (std::thread& worker : workers_) worker.join();
  }
  h6Tasks tasks() {
    return {[](void* self, void (*task)(void*), void* context) -> void* {
              auto& pool = *static_cast<OwnPool*>(self);
              std::lock_guard lock(pool.mutex_);
              pool.waiting_.push_back(new Item{task, context, false});
              pool.changed_.notify_all();
              return pool.waiting_.back();
            },
            [](void* self, void* handle) {
              auto& pool = *static_cast<OwnPool*>(self);
              auto* item = static_cast<Item*>(handle);
              std::unique_lock lock(pool.mutex_);
              const auto at = std::find(pool.waiting_.begin(), pool.waiting_.end(), item);
              if (at != pool.waiting_.end())
                pool.waiting_.erase(at);  // it has not begun, and never will
              else
                pool.changed_.wait(lock, [&] { return item->done; });
              delete item;
            },
            this};
  }
  int begun = 0;  // tasks

 private:
  struct Item {
    void (*task)(void*);
    void* context;
    bool done;
  };
  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [&] { return over_ || !waiting_.empty(); });
      if (over_) return;
      Item* item = waiting_.front();
      waiting_.pop_front();
      ++begun;
      lock.unlock();
      item->task(item->context);
      lock.lock();
      item->done = true;
      changed_.notify_all();
    }
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item*> waiting_;
  bool over_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace

TEST_CASE("every slice runs exactly once, on any thread, job after job") {
  OwnPool pool(3);
  for (const bool own : {false, true})
    for (const unsigned threads : {1u, 2u, 3u, 4u, 8u}) {
      FrameTeam team(threads, own ? pool.tasks() : h6Tasks{});
      CHECK(team.threads() == threads);
      std::vector<std::atomic<int>> ran(97);
      long wrong = 0;
      for (int frame = 0; frame < (threads > 2 ? 300 : 2000); ++frame) {
        team.begin_frame(now_ns());
        for (const std::size_t slices :
             {std::size_t{97}, std::size_t{2}, std::size_t{0}, std::size_t{1}}) {
          for (auto& r : ran) r.store(0, std::memory_order_relaxed);
          team.for_slices(slices,
                          [&](std::size_t i) { ran[i].fetch_add(1, std::memory_order_relaxed); });
          for (std::size_t i = 0; i < ran.size(); ++i)
            wrong += ran[i].load() != (i < slices ? 1 : 0);
        }
        team.end_frame(0);
      }
      CHECK(wrong == 0);
    }
}

TEST_CASE("the helper takes slices") {
  FrameTeam team(2);
  std::set<std::thread::id> seen;
  std::mutex mutex;
  for (const Patience patience; seen.size() < 2 && patience.left();) {
    team.begin_frame(now_ns());
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

TEST_CASE("a host's own TBB work never runs on the haptic thread or its helper") {
  FrameTeam team(2);
  std::mutex mutex;
  std::set<std::thread::id> ours;
  const auto frames = [&](std::int64_t ns, auto enough) {
    for (const Patience patience; !enough() && patience.left();) {
      team.begin_frame(now_ns());
      team.for_slices(8, [&](std::size_t) {
        for (const std::int64_t end = now_ns() + ns; now_ns() < end;) {
        }
        std::lock_guard lock(mutex);
        ours.insert(std::this_thread::get_id());
      });
      team.end_frame(now_ns() + 100000);
    }
  };
  frames(300000, [&] { return ours.size() == 2; });  // until the helper works
  CHECK(ours.size() == 2);

  std::atomic<bool> stop{false};
  std::atomic<long> tasks{0};
  std::set<std::thread::id> foreign;
  std::vector<std::thread> hosts;
  for (int i = 0; i < 2; ++i)
    hosts.emplace_back([&] {
      while (!stop)
        parallel_for(64, 0, [&](std::size_t) {
          for (const std::int64_t end = now_ns() + 20000; now_ns() < end;) {
          }
          ++tasks;
          std::lock_guard lock(mutex);
          foreign.insert(std::this_thread::get_id());
        });
    });
  while (tasks < 100) std::this_thread::yield();
  const long before = tasks;
  frames(20000, [left = 300]() mutable { return left-- == 0; });
  while (tasks < before + 100) std::this_thread::yield();
  stop = true;
  for (std::thread& host : hosts) host.join();
  CHECK(ours.size() == 2);  // no other thread took a slice
  for (const std::thread::id id : ours) CHECK(foreign.count(id) == 0);
}

TEST_CASE("a helper that is held up keeps its one slice, and the haptic thread takes all others") {
  FrameTeam team(2);
  const auto haptic = std::this_thread::get_id();
  std::atomic<int> by_helper{0}, by_haptic{0};
  for (const Patience patience; by_helper == 0 && patience.left();) {
    by_helper = by_haptic = 0;
    team.begin_frame(now_ns());
    team.for_slices(40, [&](std::size_t) {
      // The helper acts as if it were off its core until nothing else is left to do.
      if (std::this_thread::get_id() != haptic) {
        ++by_helper;
        for (const std::int64_t end = now_ns() + 5000000000; by_haptic < 39 && now_ns() < end;) {
        }
        return;
      }
      for (const std::int64_t end = now_ns() + 10000; now_ns() < end;) {
      }
      ++by_haptic;
    });
    team.end_frame(now_ns() + 100000);
  }
  CHECK(by_helper == 1);
  CHECK(by_haptic == 39);
}

TEST_CASE("the helper has the last slices of every job, the haptic thread the first") {
  FrameTeam team(2);
  constexpr std::size_t kSlices = 60;
  std::vector<int> by(kSlices);
  int shared = 0;
  for (const Patience patience; shared < 5 && patience.left();) {
    team.begin_frame(now_ns());
    team.for_slices(kSlices, [&](std::size_t i) {
      by[i] = static_cast<int>(FrameTeam::here());
      for (const std::int64_t end = now_ns() + 20000; now_ns() < end;) {
      }
    });
    team.end_frame(now_ns() + 100000);
    REQUIRE(std::is_sorted(by.begin(), by.end()));
    shared += by.front() == 0 && by.back() == 1;
  }
  CHECK(shared == 5);
}

TEST_CASE("a caller that steps without a pause still gets the helper") {
  FrameTeam team(2);
  int helped = 0, frames = 0;
  // Each frame announces the next one in ten milliseconds, but it comes at once.
  for (const Patience patience; helped < 50 && patience.left(); ++frames) {
    team.begin_frame(now_ns());
    team.for_slices(8, [&](std::size_t) {
      for (const std::int64_t end = now_ns() + 20000; now_ns() < end;) {
      }
    });
    helped += team.helper_work().slices > 0;
    team.end_frame(now_ns() + 10000000);
  }
  CHECK(helped == 50);
  MESSAGE(frames << " frames for 50 with help");
}

TEST_CASE("a program's own tasks take slices, and are the program's again between frames") {
  OwnPool pool(2);
  FrameTeam team(3, pool.tasks());
  std::mutex mutex;
  std::set<std::thread::id> seen;
  std::set<unsigned> numbers;
  // Both threads of the pool may come as number 1 before one of them comes as number 2.
  for (const Patience patience; (seen.size() < 3 || numbers.size() < 3) && patience.left();) {
    team.begin_frame(now_ns());
    team.for_slices(12, [&](std::size_t) {
      for (const std::int64_t end = now_ns() + 300000; now_ns() < end;) {
      }
      std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
      numbers.insert(FrameTeam::here());
    });
    team.end_frame(now_ns());
    // Every task has returned, so this one gets a thread.
    std::atomic<bool> ran{false};
    const h6Tasks tasks = pool.tasks();
    void* mine = tasks.enqueue(
        tasks.user, [](void* flag) { static_cast<std::atomic<bool>*>(flag)->store(true); }, &ran);
    while (!ran) std::this_thread::yield();
    tasks.finish(tasks.user, mine);
  }
  CHECK(seen.size() == 3);
  CHECK(numbers == std::set<unsigned>{0, 1, 2});
}

TEST_CASE("a program that runs tasks at once, on the caller, does not hang it") {
  h6Tasks tasks{[](void*, void (*task)(void*), void* context) -> void* {
                  task(context);
                  return nullptr;
                },
                [](void*, void*) {}, nullptr};
  FrameTeam team(4, tasks);
  int ran = 0;
  for (int frame = 0; frame < 100; ++frame) {
    team.begin_frame(now_ns());
    team.for_slices(9, [&](std::size_t) { ++ran; });
    team.end_frame(now_ns());
  }
  CHECK(ran == 900);
}

TEST_CASE("a team without frames can be destroyed at once") {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 5; ++i) {
    FrameTeam team(2);
    team.begin_frame(now_ns());
    team.end_frame(now_ns() + 3600000000000);  // the next frame is an hour away
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::minutes(10));
}

TEST_CASE("more teams than the machine has threads: all work, and go in any order") {
  for (const bool last_first : {false, true}) {
    std::vector<std::unique_ptr<FrameTeam>> teams;
    for (unsigned i = 0; i < machine_threads() + 2; ++i)
      teams.push_back(std::make_unique<FrameTeam>(2));
    std::atomic<int> ran{0};
    for (int frame = 0; frame < 50; ++frame)
      for (const auto& team : teams) {
        team->begin_frame(now_ns());
        team->for_slices(9, [&](std::size_t) { ++ran; });
        team->end_frame(now_ns());
      }
    CHECK(ran == static_cast<int>(50 * 9 * teams.size()));
    while (!teams.empty()) teams.erase(last_first ? teams.end() - 1 : teams.begin());
  }
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
