// SPDX-License-Identifier: Apache-2.0
// frame_team.h - a resident helper that takes slices of a frame's work from the haptic thread.
//
// To enter a TBB arena every millisecond would cost a futex call a frame. So the helper is one task
// that stays in an arena of its own from construction to destruction. It naps between frames, polls
// from shortly before the next frame is due, and claims slices from the end. The haptic thread
// claims slices from the beginning until none is left; then it waits only for the one slice that
// the helper is working on, never for a helper that was pre-empted between slices.
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

  // Bracket a frame: between these two calls the helper polls. `next_frame_ns` is when the next
  // frame is due, by now_ns(). Where frames keep coming long before that (virtual time) the helper
  // keeps polling.
  void begin_frame(std::int64_t now_ns);
  void end_frame(std::int64_t next_frame_ns);

  // Runs work(context, slice) once for every slice in 0..slices-1, on this thread and perhaps on
  // the helper, and returns when all are done. No allocation, no lock, no system call.
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
  // The time that the helper worked since begin_frame [ns]. Call it on the haptic thread, between
  // runs.
  struct HelperWork {
    std::int64_t first = 0;  // when its first slice began
    std::int64_t busy = 0;   // time in slices
    std::uint32_t slices = 0;
  };
  HelperWork helper_work() const;
  // Which thread this is, to choose scratch: 0 the haptic thread, 1 a helper.
  static int here();

  // How long the calling thread has waited for a helper's last slices since the thread began [ns].
  // It is CPU time in which the thread computed nothing.
  static std::int64_t waited_ns();

  // From its next nap on the helper runs with SCHED_FIFO of this priority (0: as it was made) on
  // any core but the haptic thread's (-1: any core). Otherwise a busy machine may take the helper
  // off its core in the middle of a slice, and the haptic thread waits for that slice.
  void set_realtime(int priority, int haptic_core);

 private:
  struct Helper;
  std::shared_ptr<Helper> helper_;  // shared with the helper's task
};

}  // namespace h6::sched
