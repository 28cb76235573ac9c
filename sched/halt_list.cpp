// SPDX-License-Identifier: Apache-2.0
// halt_list.cpp - a fixed table of atomic entries.
#include "sched/halt_list.h"

#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>

namespace h6::sched {
namespace {

// Without a lock, because a signal handler may interrupt the thread that would hold it.
struct Entry {
  std::atomic<void*> self{nullptr};  // null: free
  std::atomic<void (*)(void*)> halt{nullptr};
  std::atomic<int> process{0};
  std::atomic<int> users{0};
};
Entry list[kMostToHalt];
static_assert(std::atomic<void*>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

}  // namespace

bool add_to_halt_list(void (*halt)(void*), void* self) {
  static const bool at_exit = std::atexit(halt_all) == 0 && std::at_quick_exit(halt_all) == 0;
  if (!at_exit) return false;
  for (Entry& entry : list) {
    void* none = nullptr;
    // halt_all skips the entry until `halt` is stored.
    if (!entry.self.compare_exchange_strong(none, self)) continue;
    entry.process.store(getpid());
    entry.halt.store(halt);
    return true;
  }
  return false;
}

void remove_from_halt_list(void* self) {
  for (Entry& entry : list) {
    if (entry.self.load() != self) continue;
    entry.halt.store(nullptr);
    while (entry.users.load() != 0) sched_yield();
    entry.self.store(nullptr);
  }
}

void halt_all() {
  for (Entry& entry : list) {
    ++entry.users;
    const auto halt = entry.halt.load();
    void* const self = entry.self.load();
    if (halt && self && entry.process.load() == getpid()) halt(self);
    --entry.users;
  }
}

}  // namespace h6::sched
