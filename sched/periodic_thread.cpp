// SPDX-License-Identifier: Apache-2.0
// periodic_thread.cpp - the loop over deadlines.
#include "sched/periodic_thread.h"

#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/wake_ahead.h"

namespace h6::sched {
namespace {

void wait_for(std::int64_t deadline, WakeAhead& ahead) {
  const std::int64_t now = now_ns(), aim = ahead.aim(now, deadline);
  if (aim > now) {
    sleep_until_ns(aim);
    ahead.learn(aim, now_ns());
  }
  while (now_ns() < deadline) {
  }
}

Late cause_of(std::int64_t wakeup, std::int64_t wall, std::int64_t cpu, std::int64_t period) {
  if (wakeup + wall <= period) return Late::no;
  if (cpu > period) return Late::compute;
  // Two delays were not our work; the larger one is the cause.
  return wall - cpu >= wakeup ? Late::stolen : Late::wakeup;
}

}  // namespace

PeriodicThread::PeriodicThread(const PeriodicThreadOptions& options, Work work)
    : options_(options), work_(std::move(work)), thread_([this] { run(); }) {}

PeriodicThread::~PeriodicThread() {
  request_stop();
  join();
}

void PeriodicThread::join() {
  if (thread_.joinable()) thread_.join();
}

void PeriodicThread::run() {
  id_ = std::this_thread::get_id();
  RealtimeGrant grant;
  if (options_.realtime && !options_.virtual_time) grant = request_realtime(options_.request);
  if (work_.begin) work_.begin(grant);

  const auto period = static_cast<std::int64_t>(1e9 / options_.rate);
  WakeAhead ahead(period, static_cast<std::int64_t>(1e3 * options_.spin_us));
  std::int64_t deadline = ahead.place(now_ns() + period);
  TickTiming timing;
  for (std::uint64_t frame = 0; !stop_.load(std::memory_order_relaxed); ++frame) {
    bool more;
    if (options_.virtual_time) {
      more = work_.tick(frame, timing, 0.0);
    } else {
      wait_for(deadline, ahead);
      const std::int64_t cpu_before = thread_cpu_ns(), waited_before = FrameTeam::waited_ns();
      const std::int64_t start = now_ns();
      const double wakeup_us = 1e-3 * static_cast<double>(start - deadline);
      more = work_.tick(frame, timing, wakeup_us);
      const std::int64_t end = now_ns();
      const std::int64_t cpu = thread_cpu_ns() - cpu_before;
      // Waiting for a helper whose core the machine took is not this thread's work.
      const std::int64_t own = cpu - (FrameTeam::waited_ns() - waited_before);
      const Late late = cause_of(start - deadline, end - start, own, period);
      timing = {wakeup_us, late,
                late == Late::no ? 0.0 : 1e-3 * static_cast<double>(end - deadline - period),
                1e-3 * static_cast<double>(cpu)};
      deadline += period;
      if (end > deadline + period) deadline = ahead.place(end + period);
    }
    if (work_.done) work_.done(frame, timing);
    if (!more) break;
  }
  release_realtime(grant);
  id_ = std::thread::id{};
  running_.store(false, std::memory_order_release);
}

}  // namespace h6::sched
