// SPDX-License-Identifier: Apache-2.0
// frame_team.h - helpers that take slices of a frame's work from the haptic thread.
//
// To enter a TBB arena every millisecond would cost a futex call a frame. So each helper is one
// task that stays in an arena of its own from construction to destruction. It naps between frames,
// polls from shortly before the next frame is due, and claims slices from the end. The haptic
// thread claims slices from the beginning until none is left; then it waits only for the slices
// that helpers are working on, never for a helper that was pre-empted between slices. A program
// that brings its own tasks lends them for the length of each frame.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "hapsix/base.h"
#include "sched/host_memory.h"

namespace h6::sched {

class FrameTeam {
 public:
  // `threads` 1: no helper, everything runs on the caller. Else threads - 1 helpers, up to
  // kMostThreads in all: tasks of the program where `tasks` has callbacks.
  static constexpr unsigned kMostThreads = 64;
  // With those, all memory of the team is of the caller's HostScope.
  explicit FrameTeam(unsigned threads, const h6Tasks& tasks = {});
  ~FrameTeam();
  FrameTeam(const FrameTeam&) = delete;
  FrameTeam& operator=(const FrameTeam&) = delete;

  // Bracket a frame: between these two calls the helpers poll. `next_frame_ns` is when the next
  // frame is due, by now_ns(). Where frames keep coming long before that (virtual time) the helpers
  // keep polling. With a program's own tasks, begin_frame enqueues them and end_frame finishes
  // them.
  void begin_frame(std::int64_t now_ns);
  void end_frame(std::int64_t next_frame_ns);

  // Runs work(context, slice) once for every slice in 0..slices-1, on this thread and perhaps on
  // helpers, and returns when all are done. No allocation, no lock, no system call.
  static constexpr std::size_t kMaxSlices = 65535;
  using Slice = void (*)(void* context, std::size_t slice);
  void run(std::size_t slices, Slice work, void* context);

  // Benches compare other ways to run slices. `runner` then replaces the helpers of a team that was
  // made for `threads`; its threads call be() with a number below that.
  using Runner = void (*)(void* self, std::size_t slices, Slice work, void* context);
  void replace_helpers(Runner runner, void* self, unsigned threads);
  static void be(unsigned number);

  template <class F>
  void for_slices(std::size_t slices, F&& body) {
    using Body = std::remove_reference_t<F>;
    run(
        slices, [](void* context, std::size_t slice) { (*static_cast<Body*>(context))(slice); },
        const_cast<void*>(static_cast<const void*>(&body)));
  }
  unsigned threads() const;
  // The time that all helpers worked since begin_frame [ns]. Call it on the haptic thread, between
  // runs.
  struct HelperWork {
    std::int64_t first = 0;  // when their first slice began
    std::int64_t busy = 0;   // time in slices
    std::uint32_t slices = 0;
  };
  HelperWork helper_work() const;
  // Which thread of its team this is, to choose scratch: 0 the haptic thread, 1 .. threads() - 1 a
  // helper.
  static unsigned here();

  // How long the calling thread has waited for helpers' last slices since the thread began [ns]. It
  // is CPU time in which the thread computed nothing.
  static std::int64_t waited_ns();

  // From its next nap on each helper runs with SCHED_FIFO of this priority (0: as it was made) on
  // any core but the haptic thread's (-1: any core). Otherwise a busy machine may take a helper off
  // its core in the middle of a slice, and the haptic thread waits for that slice. Tasks of the
  // program are its own affair.
  void set_realtime(int priority, int haptic_core);

 private:
  struct Job;
  struct Resident;
  struct Lent;
  std::shared_ptr<Job> job_;  // shared with the helpers
  std::unique_ptr<std::shared_ptr<Resident>[]> resident_;
  HostVector<Lent> lent_;
  std::shared_ptr<void> allowance_;
  unsigned threads_ = 1;
  Runner runner_ = nullptr;
  void* runner_self_ = nullptr;
};

}  // namespace h6::sched
