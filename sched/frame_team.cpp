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

// The thread belongs to TBB: it gets back what it came with.
class Treatment {
 public:
  Treatment() { pthread_getaffinity_np(pthread_self(), sizeof came_with_, &came_with_); }
  ~Treatment() { set(0, -1); }
  void set(int priority, int haptic_core) {
    cpu_set_t cores = came_with_;
    if (priority > 0 && haptic_core >= 0) CPU_CLR(haptic_core, &cores);
    // With no other core it would only stand in the way.
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

constexpr std::int64_t kNap = 50000;  // ns; how late the helper may notice an early frame
}  // namespace

// One job at a time. The ticket is the whole job in one word: its number (32 bits), how many slices
// it has (16) and the next free one (16). A claim is one compare-and-swap of that word, so a helper
// that wakes late can never take a slice of a job that is over, nor read a job that is being set
// up.
struct FrameTeam::Helper {
  oneapi::tbb::task_arena arena{1, 0};
  std::atomic<bool> stop{false}, ended{false};
  std::atomic<bool> polling{false};         // a frame is on
  std::atomic<std::int64_t> next_frame{0};  // when the next frame is due
  std::atomic<int> treatment{0};            // priority + 256 * (the haptic thread's core + 1)
  alignas(64) std::atomic<std::uint64_t> ticket{0};
  alignas(64) std::atomic<std::uint32_t> done{0};  // slices of this job that are finished
  // Written before the ticket is published, read after a claim.
  Slice work = nullptr;
  void* context = nullptr;
  std::uint32_t job = 0;
  // Written by the helper before it counts a slice as done, read and cleared when all are.
  HelperWork helped;

  static std::uint64_t ticket_of(std::uint32_t job, std::size_t slices) {
    return std::uint64_t{job} << 32 | std::uint64_t{slices} << 16;
  }

  // Takes and runs one slice of the current job; false when none is free.
  bool work_one(bool by_helper) {
    std::uint64_t t = ticket.load(std::memory_order_acquire);
    std::uint32_t next, slices;
    do {
      next = t & 0xffff;
      slices = t >> 16 & 0xffff;
      if (next >= slices) return false;
    } while (!ticket.compare_exchange_weak(t, t + 1, std::memory_order_acq_rel,
                                           std::memory_order_acquire));
    if (by_helper) {
      const std::int64_t start = now_ns();
      if (helped.slices++ == 0) helped.first = start;
      work(context, next);
      helped.busy += now_ns() - start;
    } else {
      work(context, next);
    }
    done.fetch_add(1, std::memory_order_release);
    return true;
  }

  void help() {
    (void)polling.load(std::memory_order_acquire);
    FlushDenormals flush;
    Treatment treated;
    this_is_helper = 1;
    int as = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (!polling.load(std::memory_order_acquire)) {
        if (const int asked = treatment.load(std::memory_order_relaxed); asked != as)
          treated.set((as = asked) % 256, asked / 256 - 1);
        const std::int64_t due = next_frame.load(std::memory_order_relaxed) - kPollBefore;
        const std::int64_t now = now_ns();
        if (now < due)
          sleep_until_ns(due < now + kNap * 20 ? due : now + kNap * 20);
        else if (now > due + 2 * kPollBefore)  // nobody steps: the longer, the lazier
          sleep_until_ns(now + (now - due > 2000 * kNap ? 20 * kNap : kNap));
        else
          relax();
        continue;
      }
      if (!work_one(true)) relax();
    }
    this_is_helper = 0;
    ended.store(true, std::memory_order_release);
  }
};

FrameTeam::FrameTeam(unsigned threads) {
  if (threads < 2) return;
  helper_ = std::make_unique<Helper>();
  // Polling is off until the first frame; the store also orders construction before the helper's
  // work.
  helper_->polling.store(false, std::memory_order_release);
  // The sanitizer cannot see TBB hand the closure over; what it calls is watched as ever.
  helper_->arena.enqueue([helper = helper_.get()]()
                             __attribute__((no_sanitize("thread"))) { helper->help(); });
}

FrameTeam::~FrameTeam() {
  if (!helper_) return;
  helper_->stop.store(true, std::memory_order_relaxed);
  while (!helper_->ended.load(std::memory_order_acquire)) std::this_thread::yield();
}

unsigned FrameTeam::threads() const { return helper_ ? 2 : 1; }

int FrameTeam::here() { return this_is_helper; }

void FrameTeam::set_realtime(int priority, int haptic_core) {
  if (helper_)
    helper_->treatment.store(priority > 0 ? priority + 256 * (haptic_core + 1) : 0,
                             std::memory_order_relaxed);
}

void FrameTeam::begin_frame() {
  if (!helper_) return;
  helper_->helped = {};
  helper_->polling.store(true, std::memory_order_release);
}

FrameTeam::HelperWork FrameTeam::helper_work() const {
  return helper_ ? helper_->helped : HelperWork{};
}

void FrameTeam::end_frame(std::int64_t next_frame_ns) {
  if (!helper_) return;
  helper_->next_frame.store(next_frame_ns, std::memory_order_relaxed);
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
  while (h.done.load(std::memory_order_acquire) != slices) relax();
}

}  // namespace h6::sched
