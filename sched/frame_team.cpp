// SPDX-License-Identifier: Apache-2.0
// frame_team.cpp - the ticket that both threads claim slices from, and the helper's life.
#include "sched/frame_team.h"

#include <oneapi/tbb/task_arena.h>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <ctime>
#include <thread>

#include "hapsix/base.h"
#include "sched/clock.h"
#include "sched/realtime.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace h6::sched {
namespace {
void relax() {
#if defined(__SSE2__)
  _mm_pause();
#endif
}
constexpr std::int64_t kPollBefore = 150000;  // ns before the next frame is due

thread_local int this_is_helper = 0;
thread_local std::int64_t this_waited = 0;

// Core and priority of the helper's thread. The thread belongs to TBB, so both are given back.
class Treatment {
 public:
  Treatment() { pthread_getaffinity_np(pthread_self(), sizeof came_with_, &came_with_); }
  ~Treatment() { set(0, -1); }
  void set(int priority, int haptic_core) {
    cpu_set_t cores = came_with_;
    if (haptic_core >= 0) CPU_CLR(haptic_core, &cores);
    // Without another core the helper must not compete with the haptic thread.
    const bool alone = CPU_COUNT(&cores) == 0;
    pthread_setaffinity_np(pthread_self(), sizeof cores, alone ? &came_with_ : &cores);
    sched_param parameters{};
    parameters.sched_priority = alone ? 0 : priority;
    const int policy = parameters.sched_priority > 0 ? SCHED_FIFO : SCHED_OTHER;
    pthread_setschedparam(pthread_self(), policy, &parameters);
  }

 private:
  cpu_set_t came_with_{};
};

// Sharing costs some 0.7 us while the helper polls: a job of 4 us takes 2.7 on both threads. Less
// work than that does not pay.
constexpr int kInHaste = 2;           // after so many early frames the next one is expected early
constexpr std::int64_t kNap = 50000;  // how late the helper may notice an early frame [ns]
}  // namespace

// There is one job at a time, and the ticket is the whole job in one word: its number (32 bits),
// the end of its free slices (16) and the first of them (16). A claim is one compare-and-swap of
// that word, so a helper that wakes late can neither take a slice of a finished job nor read a job
// that is being set up. The haptic thread takes the first free slice, the helper the last: from
// frame to frame each gets the same slices, whose data are still in its cache.
struct FrameTeam::Helper {
  oneapi::tbb::task_arena arena{1, 0};  // lives as long as its task waits
  // Where TBB has no thread left the task may never start. The destructor then abandons it.
  enum State { kWaiting, kHelping, kEnded, kAbandoned };
  std::atomic<int> state{kWaiting};
  std::atomic<bool> stop{false};
  std::atomic<bool> polling{false};         // a frame is running
  std::atomic<std::int64_t> next_frame{0};  // when the next frame is due
  std::atomic<int> treatment{0};            // priority + 256 * (the haptic thread's core + 1)
  std::atomic<int> frame_core{-1};          // the core on which the last frame began
  alignas(64) std::atomic<std::uint64_t> ticket{0};
  alignas(64) std::atomic<std::uint32_t> done{0};  // slices of this job that are finished
  // Written before the ticket is published, read after a claim.
  Slice work = nullptr;
  void* context = nullptr;
  std::uint32_t job = 0;
  std::int64_t announced = 0;  // when the next frame is due, as end_frame was told
  int early = 0;               // frames in a row that came long before they were due
  // The helper writes it before it counts a slice as done; it is read and cleared between jobs.
  HelperWork helped;

  static std::uint64_t ticket_of(std::uint32_t job, std::size_t slices) {
    return std::uint64_t{job} << 32 | std::uint64_t{slices} << 16;
  }

  // Takes and runs one slice of the current job; false when none is free.
  bool work_one(bool by_helper) {
    std::uint64_t t = ticket.load(std::memory_order_acquire), claimed;
    std::uint32_t first, end;
    do {
      first = t & 0xffff;
      end = t >> 16 & 0xffff;
      if (first >= end) return false;
      claimed = by_helper ? t - 0x10000 : t + 1;
    } while (!ticket.compare_exchange_weak(t, claimed, std::memory_order_acq_rel,
                                           std::memory_order_acquire));
    if (by_helper) {
      const std::int64_t start = now_ns();
      if (helped.slices++ == 0) helped.first = start;
      work(context, end - 1);
      helped.busy += now_ns() - start;
    } else {
      work(context, first);
    }
    done.fetch_add(1, std::memory_order_release);
    return true;
  }

  void help() {
    (void)polling.load(std::memory_order_acquire);
    int waiting = kWaiting;
    if (!state.compare_exchange_strong(waiting, kHelping, std::memory_order_acq_rel)) return;
    FlushDenormals flush;
    Treatment treated;
    this_is_helper = 1;
    int as = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (!polling.load(std::memory_order_acquire)) {
        int asked = treatment.load(std::memory_order_relaxed);
        // Without set_realtime the helper still leaves the core on which frames begin.
        if (const int core = frame_core.load(std::memory_order_relaxed);
            asked == 0 && core >= 0 && core == sched_getcpu())
          asked = 256 * (core + 1);
        else if (asked == 0)
          asked = as;
        if (asked != as) treated.set((as = asked) % 256, asked / 256 - 1);
        const std::int64_t due = next_frame.load(std::memory_order_relaxed) - kPollBefore;
        const std::int64_t now = now_ns();
        if (now < due)
          sleep_until_ns(due < now + kNap * 20 ? due : now + kNap * 20);
        else if (now > due + 2 * kPollBefore)  // no frames come: nap, and longer after a while
          sleep_until_ns(now + (now - due > 2000 * kNap ? 20 * kNap : kNap));
        else
          relax();
        continue;
      }
      if (!work_one(true)) relax();
    }
    this_is_helper = 0;
    state.store(kEnded, std::memory_order_release);
  }
};

FrameTeam::FrameTeam(unsigned threads) {
  if (threads < 2) return;
  helper_ = std::make_shared<Helper>();
  // Polling is off until the first frame; the store also orders construction before the helper's
  // work.
  helper_->polling.store(false, std::memory_order_release);
  // A thread sanitizer cannot see how TBB hands the closure over, so it must ignore this body. The
  // body reads the raw pointer, not the shared one, because functions that it calls are watched.
  helper_->arena.enqueue([ kept = helper_, helper = helper_.get() ]()
                             __attribute__((no_sanitize("thread"))) { helper->help(); });
}

FrameTeam::~FrameTeam() {
  if (!helper_) return;
  int waiting = Helper::kWaiting;
  if (helper_->state.compare_exchange_strong(waiting, Helper::kAbandoned,
                                             std::memory_order_acq_rel))
    return;
  helper_->stop.store(true, std::memory_order_relaxed);
  while (helper_->state.load(std::memory_order_acquire) != Helper::kEnded)
    std::this_thread::yield();
}

unsigned FrameTeam::threads() const { return helper_ ? 2 : 1; }

int FrameTeam::here() { return this_is_helper; }
std::int64_t FrameTeam::waited_ns() { return this_waited; }

void FrameTeam::set_realtime(int priority, int haptic_core) {
  if (helper_)
    helper_->treatment.store(priority + 256 * (haptic_core + 1), std::memory_order_relaxed);
}

void FrameTeam::begin_frame(std::int64_t now) {
  if (!helper_) return;
  Helper& h = *helper_;
  h.helped = {};
  const bool early = now < h.announced - kPollBefore;
  h.early = early ? h.early + (h.early < kInHaste) : 0;
  h.frame_core.store(sched_getcpu(), std::memory_order_relaxed);
  h.polling.store(true, std::memory_order_release);
}

FrameTeam::HelperWork FrameTeam::helper_work() const {
  return helper_ ? helper_->helped : HelperWork{};
}

void FrameTeam::end_frame(std::int64_t next_frame_ns) {
  if (!helper_) return;
  helper_->announced = next_frame_ns;
  // Where the caller steps as fast as it can, the helper does not fall asleep.
  const bool haste = helper_->early >= kInHaste;
  helper_->next_frame.store(haste ? now_ns() + kPollBefore : next_frame_ns,
                            std::memory_order_relaxed);
  helper_->polling.store(false, std::memory_order_release);
}

void FrameTeam::run(std::size_t slices, Slice work, void* context) {
  H6_ASSERT(slices < kMaxSlices);
  if (!helper_ || slices < 2) {
    for (std::size_t i = 0; i < slices; ++i) work(context, i);
    return;
  }
  Helper& h = *helper_;
  h.work = work;
  h.context = context;
  h.done.store(0, std::memory_order_relaxed);
  h.ticket.store(Helper::ticket_of(++h.job, slices), std::memory_order_release);
  while (h.work_one(false)) {
  }
  if (h.done.load(std::memory_order_acquire) == slices) return;
  const std::int64_t since = now_ns();
  while (h.done.load(std::memory_order_acquire) != slices) relax();
  this_waited += now_ns() - since;
}

}  // namespace h6::sched
