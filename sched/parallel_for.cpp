// SPDX-License-Identifier: Apache-2.0
// parallel_for.cpp - the loop in an arena of its own.
#include "sched/parallel_for.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <memory>
#include <vector>

namespace h6::sched {
namespace {

// Our own arena, so that the host program's TBB work neither enters it nor waits for it. The
// calling thread keeps it, because a new arena with workers takes longer than many a loop.
oneapi::tbb::task_arena& own_arena(unsigned threads) {
  thread_local std::vector<std::unique_ptr<oneapi::tbb::task_arena>> arenas;
  if (arenas.size() <= threads) arenas.resize(threads + 1);
  auto& arena = arenas[threads];
  if (!arena) arena = std::make_unique<oneapi::tbb::task_arena>(static_cast<int>(threads));
  return *arena;
}

}  // namespace

unsigned machine_threads() {
  return static_cast<unsigned>(oneapi::tbb::info::default_concurrency());
}

unsigned usable_threads(unsigned threads) {
  // TBB warns when asked for more threads than the machine has.
  const unsigned most = machine_threads();
  return threads == 0 || threads > most ? most : threads;
}

void parallel_for(std::size_t count, unsigned threads,
                  const std::function<void(std::size_t)>& body) {
  threads = usable_threads(threads);
  if (threads == 1 || count < 2) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  // TBB orders these accesses already. The atomics repeat it for a thread sanitizer, which cannot
  // see into a TBB that was built without it.
  std::atomic<std::size_t> order{0};
  order.store(1, std::memory_order_release);
  own_arena(threads).execute([&] {
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, count),
                              [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                                (void)order.load(std::memory_order_acquire);
                                for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
                                order.fetch_add(1, std::memory_order_release);
                              });
  });
  (void)order.load(std::memory_order_acquire);
}

}  // namespace h6::sched
