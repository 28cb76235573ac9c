// SPDX-License-Identifier: Apache-2.0
// frame_team.cpp - the ticket that all threads claim slices from, and a helper's life.
#include "sched/frame_team.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <thread>

#include "hapsix/base.h"
#include "sched/clock.h"
#include "sched/parallel_for.h"
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

thread_local unsigned this_is_helper = 0;
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

constexpr int kInHaste = 2;           // after so many early frames the next one is expected early
constexpr std::int64_t kNap = 50000;  // how late the helper may notice an early frame [ns]
}  // namespace

// There is one job at a time, and the ticket is the whole job in one word: its number (32 bits),
// the end of its free slices (16) and the first of them (16). A claim is one compare-and-swap of
// that word, so a helper that wakes late can neither take a slice of a finished job nor read a job
// that is being set up. The haptic thread takes the first free slice, helpers the last: from frame
// to frame each gets about the same slices, whose data are still in its cache.
struct FrameTeam::Job {
  std::atomic<bool> polling{false};  // a frame is running
  alignas(64) std::atomic<std::uint64_t> ticket{0};
  alignas(64) std::atomic<std::uint32_t> done{0};  // slices of this job that are finished
  // Written before the ticket is published, read after a claim.
  Slice work = nullptr;
  void* context = nullptr;
  std::uint32_t number = 0;
  // A helper writes its own before it counts a slice as done; read and cleared between jobs.
  struct alignas(64) Helped : HelperWork {};
  HostVector<Helped> helped;  // (threads)

  explicit Job(unsigned threads) : helped(threads) {}
  static std::uint64_t ticket_of(std::uint32_t number, std::size_t slices) {
    return std::uint64_t{number} << 32 | std::uint64_t{slices} << 16;
  }

  // Takes and runs one slice of the current job; false when none is free. `by`: 0 is the haptic
  // thread.
  bool work_one(unsigned by) {
    std::uint64_t t = ticket.load(std::memory_order_acquire), claimed;
    std::uint32_t first, end;
    do {
      first = t & 0xffff;
      end = t >> 16 & 0xffff;
      if (first >= end) return false;
      claimed = by > 0 ? t - 0x10000 : t + 1;
    } while (!ticket.compare_exchange_weak(t, claimed, std::memory_order_acq_rel,
                                           std::memory_order_acquire));
    if (by > 0) {
      const std::int64_t start = now_ns();
      HelperWork& mine = helped[by];
      if (mine.slices++ == 0) mine.first = start;
      work(context, end - 1);
      mine.busy += now_ns() - start;
    } else {
      work(context, first);
    }
    done.fetch_add(1, std::memory_order_release);
    return true;
  }
};

// A helper that stays for the life of the team.
struct FrameTeam::Resident {
  oneapi::tbb::task_arena arena{1, 0};  // lives as long as its task waits
  std::shared_ptr<Job> job;
  unsigned number;
  // Where TBB has no thread left the task may never start. The destructor then abandons it.
  enum State { kWaiting, kHelping, kEnded, kAbandoned };
  std::atomic<int> state{kWaiting};
  std::atomic<bool> stop{false};
  std::atomic<std::int64_t> next_frame{0};  // when the next frame is due
  std::atomic<int> treatment{0};            // priority + 256 * (the haptic thread's core + 1)
  std::atomic<int> frame_core{-1};          // the core on which the last frame began
  std::int64_t announced = 0;               // when the next frame is due, as end_frame was told
  int early = 0;                            // frames in a row that came long before they were due

  void help() {
    (void)state.load(std::memory_order_acquire);  // what the constructor wrote before
    int waiting = kWaiting;
    if (!state.compare_exchange_strong(waiting, kHelping, std::memory_order_acq_rel)) return;
    FlushDenormals flush;
    Treatment treated;
    this_is_helper = number;
    int as = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (job->polling.load(std::memory_order_acquire)) {
        if (!job->work_one(number)) relax();
        continue;
      }
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
    }
    this_is_helper = 0;
    state.store(kEnded, std::memory_order_release);
  }

  void begin_frame(std::int64_t now) {
    const bool is_early = now < announced - kPollBefore;
    early = is_early ? early + (early < kInHaste) : 0;
    frame_core.store(sched_getcpu(), std::memory_order_relaxed);
  }
  void end_frame(std::int64_t next) {
    announced = next;
    // Where the caller steps as fast as it can, the helper does not fall asleep.
    next_frame.store(early >= kInHaste ? now_ns() + kPollBefore : next, std::memory_order_relaxed);
  }
  void end() {
    int waiting = kWaiting;
    if (state.compare_exchange_strong(waiting, kAbandoned, std::memory_order_acq_rel)) return;
    stop.store(true, std::memory_order_relaxed);
    while (state.load(std::memory_order_acquire) != kEnded) std::this_thread::yield();
  }
};

// A task of the program that helps during one frame.
struct FrameTeam::Lent {
  Job* job = nullptr;
  h6Tasks tasks{};
  unsigned number = 0;
  void* handle = nullptr;
  pthread_t caller{};

  static void help(void* self) {
    const Lent& lent = *static_cast<Lent*>(self);
    // A program without free threads may run the task at once, where it would wait for itself.
    if (pthread_equal(lent.caller, pthread_self())) return;
    FlushDenormals flush;
    const unsigned before = this_is_helper;
    this_is_helper = lent.number;
    while (lent.job->polling.load(std::memory_order_acquire))
      if (!lent.job->work_one(lent.number)) relax();
    this_is_helper = before;
  }
  void begin_frame() {
    caller = pthread_self();
    handle = tasks.enqueue(tasks.user, help, this);
  }
  void end_frame() { tasks.finish(tasks.user, handle); }
};

FrameTeam::FrameTeam(unsigned threads, const h6Tasks& tasks)
    : threads_(std::clamp(threads, 1u, kMostThreads)) {
  if (threads_ < 2) return;
  const unsigned helpers = threads_ - 1;
  if (tasks.enqueue && tasks.finish) {
    job_ = std::allocate_shared<Job>(HostMemory<Job>(), threads_);
    lent_.resize(helpers);
    for (unsigned i = 0; i < helpers; ++i) lent_[i] = {job_.get(), tasks, i + 1, nullptr, {}};
    return;
  }
  // A thread of TBB may hold the job when the team has ended, so it takes the heap.
  const HostScope heap({});
  job_ = std::make_shared<Job>(threads_);
  // TBB makes no more workers than the machine has cores, unless it is told.
  using Control = oneapi::tbb::global_control;
  if (threads_ > machine_threads())
    allowance_ = std::make_shared<Control>(Control::max_allowed_parallelism, threads_);
  resident_ = std::make_unique<std::shared_ptr<Resident>[]>(helpers);
  for (unsigned i = 0; i < helpers; ++i) {
    auto helper = std::make_shared<Resident>();
    helper->job = job_;
    helper->number = i + 1;
    resident_[i] = helper;
    // A thread sanitizer cannot see how TBB hands the closure over. So help() gets all that was
    // written up to here through this store, and the closure's body, which reads the raw pointer,
    // is not watched.
    helper->state.store(Resident::kWaiting, std::memory_order_release);
    helper->arena.enqueue([ kept = helper, raw = helper.get() ]()
                              __attribute__((no_sanitize("thread"))) { raw->help(); });
  }
}

FrameTeam::~FrameTeam() {
  for (unsigned i = 0; resident_ && i + 1 < threads_; ++i) resident_[i]->end();
}

unsigned FrameTeam::threads() const { return threads_; }

unsigned FrameTeam::here() { return this_is_helper; }
void FrameTeam::be(unsigned number) { this_is_helper = number; }
void FrameTeam::replace_helpers(Runner runner, void* self, unsigned threads) {
  H6_ASSERT(!job_);
  runner_ = runner;
  runner_self_ = self;
  threads_ = threads;
}
std::int64_t FrameTeam::waited_ns() { return this_waited; }

void FrameTeam::set_realtime(int priority, int haptic_core) {
  for (unsigned i = 0; resident_ && i + 1 < threads_; ++i)
    resident_[i]->treatment.store(priority + 256 * (haptic_core + 1), std::memory_order_relaxed);
}

void FrameTeam::begin_frame(std::int64_t now) {
  if (!job_) return;
  for (unsigned i = 0; i < threads_; ++i) job_->helped[i] = {};
  for (unsigned i = 0; resident_ && i + 1 < threads_; ++i) resident_[i]->begin_frame(now);
  job_->polling.store(true, std::memory_order_release);
  for (Lent& lent : lent_) lent.begin_frame();
}

FrameTeam::HelperWork FrameTeam::helper_work() const {
  HelperWork all;
  for (unsigned i = 1; job_ && i < threads_; ++i) {
    const HelperWork& one = job_->helped[i];
    if (one.slices == 0) continue;
    all.first = all.slices == 0 ? one.first : std::min(all.first, one.first);
    all.busy += one.busy;
    all.slices += one.slices;
  }
  return all;
}

void FrameTeam::end_frame(std::int64_t next_frame_ns) {
  if (!job_) return;
  for (unsigned i = 0; resident_ && i + 1 < threads_; ++i) resident_[i]->end_frame(next_frame_ns);
  job_->polling.store(false, std::memory_order_release);
  for (Lent& lent : lent_) lent.end_frame();
}

void FrameTeam::run(std::size_t slices, Slice work, void* context) {
  H6_ASSERT(slices < kMaxSlices);
  if (runner_ && slices > 1) return runner_(runner_self_, slices, work, context);
  if (!job_ || slices < 2) {
    for (std::size_t i = 0; i < slices; ++i) work(context, i);
    return;
  }
  Job& job = *job_;
  job.work = work;
  job.context = context;
  job.done.store(0, std::memory_order_relaxed);
  job.ticket.store(Job::ticket_of(++job.number, slices), std::memory_order_release);
  while (job.work_one(0)) {
  }
  if (job.done.load(std::memory_order_acquire) == slices) return;
  const std::int64_t since = now_ns();
  while (job.done.load(std::memory_order_acquire) != slices) relax();
  this_waited += now_ns() - since;
}

}  // namespace h6::sched
