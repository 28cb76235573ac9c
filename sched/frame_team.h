// SPDX-License-Identifier: Apache-2.0
// frame_team.h - a resident helper that takes slices of a frame's work from the haptic thread.
//
// Entering a TBB arena every millisecond costs a futex call a frame. So the helper is one task that
// stays in an arena of its own from construction to destruction: it naps between frames, polls from
// shortly before the next one is expected, and claims slices from the end. The haptic thread claims
// from the beginning until none is left, then waits at most for the one slice that the helper has
// in hand: a helper that is pre-empted between slices is not waited for.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace h6::sched {

class FrameTeam {
 public:
  // `threads` 1: no helper, everything runs on the caller. 2: one helper.
  explicit FrameTeam(unsigned threads);
  ~FrameTeam();
  FrameTeam(const FrameTeam&) = delete;
  FrameTeam& operator=(const FrameTeam&) = delete;

  // Brackets a frame: the helper polls between these two. `next_frame_ns` tells it when the next
  // one is due, by now_ns(); where frames keep coming long before that (virtual time) it polls on.
  void begin_frame(std::int64_t now_ns);
  void end_frame(std::int64_t next_frame_ns);

  // Runs work(context, slice) for every slice in 0..slices-1, each once, on this thread and perhaps
  // on the helper; returns when all are done. No allocation, no lock, no system call.
  static constexpr std::size_t kMaxSlices = 65535;
  using Slice = void (*)(void* context, std::size_t slice);
  void run(std::size_t slices, Slice work, void* context);

  template <class F>
  void for_slices(std::size_t slices, F&& body) {
    using Body = std::remove_reference_t<F>;
    run(
        slices, [](void* context, std::size_t slice) { (*static_cast<Body*>(context))(slice); },
        const_cast<void*>(static_cast<const void*>(&body)));
  }
  unsigned threads() const;
  // What the helper did since begin_frame, by the clock [ns]; on the caller's thread, after a run.
  struct HelperWork {
    std::int64_t first = 0;  // its first slice began
    std::int64_t busy = 0;   // in slices
    std::uint32_t slices = 0;
  };
  HelperWork helper_work() const;
  // Whose thread this is, for scratch of its own: 0 the caller's, 1 a helper's.
  static int here();

  // How long the calling thread has waited for slices that a helper had in hand, since it began:
  // CPU time in which it computed nothing.
  static std::int64_t waited_ns();

  // From the helper's next nap on: SCHED_FIFO of this priority (0: as it was made), on any core but
  // that of the haptic thread (-1: any). Without it a busy machine takes the helper off its core in
  // the midst of a slice, and the haptic thread waits for that slice.
  void set_realtime(int priority, int haptic_core);

 private:
  struct Helper;
  std::shared_ptr<Helper> helper_;  // its task's too
};

}  // namespace h6::sched
