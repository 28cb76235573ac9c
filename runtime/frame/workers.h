// SPDX-License-Identifier: Apache-2.0
// workers.h - threads that step many sessions, and the scratch that these sessions share.
//
// A session that only ever steps in h6StepMany needs no scratch while others step, so its workers
// have one for each thread. A thread's scratch then stays in its cache from session to session.
#pragma once
#include <atomic>

#include "hapsix/batch.h"
#include "runtime/frame/scratch_memory.h"
#include "runtime/frame/session_slabs.h"
#include "sched/frame_team.h"
#include "sched/host_memory.h"

struct h6Workers {
  h6Workers(unsigned threads, const h6WorkersDef& def)
      : team(threads, def.tasks), allocator(def.allocator), scratch(threads) {}
  ~h6Workers() { h6::release(allocator, memory, memory_bytes); }
  h6Workers(const h6Workers&) = delete;
  h6Workers& operator=(const h6Workers&) = delete;

  h6::sched::FrameTeam team;
  std::atomic<bool> busy{false};  // a call steps sessions, or uses a scratch
  h6Allocator allocator;
  h6::sched::HostVector<h6::Scratch> scratch;  // (threads) columns in `memory`
  h6::ScratchRoom room;                        // of each
  void* memory = nullptr;
  std::size_t memory_bytes = 0;
  h6::SessionSlabs slabs;  // of sessions without an allocator of their own
};

namespace h6 {

// The workers for as long as this lives, unless somebody else has them.
class Turn {
 public:
  explicit Turn(h6Workers* workers)
      : workers_(workers),
        mine_(!workers || !workers->busy.exchange(true, std::memory_order_acquire)) {}
  ~Turn() {
    if (mine_ && workers_) workers_->busy.store(false, std::memory_order_release);
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  explicit operator bool() const { return mine_; }

 private:
  h6Workers* workers_;
  bool mine_;
};

// Enlarges every thread's scratch to this room. The caller has the turn. False: `error` says that
// there is no memory, and nothing has changed.
bool make_room(h6Workers& workers, const ScratchRoom& room, h6Error* error);

}  // namespace h6
