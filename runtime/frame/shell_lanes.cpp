// SPDX-License-Identifier: Apache-2.0
// shell_lanes.cpp - weighs shell bodies one after the other, or two at a time.
#include "runtime/frame/shell_lanes.h"

#include <algorithm>

#include "sched/clock.h"

namespace h6 {
namespace {

constexpr double kWorthSharing = 6000;  // least time that the other thread must save [ns]
// If one shell body has more than this share of the work, both threads share that body's work.
constexpr double kLopsided = 0.7;

// Whether there is enough work for two threads, in several shell bodies.
bool worth_two(const Lanes& lanes, std::span<const ShellBody> shells) {
  // With a budget the clock decides pair after pair, in order.
  if (!lanes.two || lanes.whole.anytime->by_clock) return false;
  double all = 0, most = 0;
  for (const ShellBody& shell : shells) {
    all += shell.all_ns;
    most = std::max(most, shell.all_ns);
  }
  return all - most > (lanes.side_by_side ? 0.5 : 1.0) * kWorthSharing && most <= kLopsided * all;
}

void join(h6FrameReport& to, const h6FrameReport& from) {
  to.status |= from.status;
  to.contacts += from.contacts;
  to.max_depth = std::max(to.max_depth, from.max_depth);
  to.max_depth_voxels = std::max(to.max_depth_voxels, from.max_depth_voxels);
  to.missed_depth_voxels = std::max(to.missed_depth_voxels, from.missed_depth_voxels);
  to.fit_depth_voxels = std::max(to.fit_depth_voxels, from.fit_depth_voxels);
  to.series_iterations = std::max(to.series_iterations, from.series_iterations);
  to.series_residual = std::max(to.series_residual, from.series_residual);
}

// The stages of two lanes overlap. Each stage is reported with its share of the wall time, in
// proportion to its work, so that the stages of a frame add up to no more than the frame.
void join_times(const Lanes& lanes, double wall_us, h6FrameReport& report) {
  double work = 0;
  for (const Lane& lane : lanes.single)
    for (const double us : lane.report.stage_us) work += us;
  for (int stage = 0; work > 0 && stage < H6_STAGE_COUNT; ++stage)
    report.stage_us[stage] +=
        wall_us / work *
        (lanes.single[0].report.stage_us[stage] + lanes.single[1].report.stage_us[stage]);
}

void run_side_by_side(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
                      std::span<ShellBody> shells, WeighShell weigh, h6FrameReport& report) {
  const std::int64_t start = sched::ticks();
  lanes.whole.team->for_slices(shells.size(), [&](std::size_t i) {
    const std::int64_t since = sched::now_ns();
    weigh(set, bodies, shells[i], lanes.single[sched::FrameTeam::here()]);
    shells[i].all_ns = static_cast<double>(sched::now_ns() - since);
  });
  for (const Lane& lane : lanes.single) join(report, lane.report);
  const double took = lanes.whole.tick_ns * static_cast<double>(sched::ticks() - start);
  join_times(lanes, 1e-3 * took, report);
}

}  // namespace

void open_lanes(Lanes& lanes, sched::FrameTeam* team, sched::FrameTeam* alone, Anytime* anytime) {
  lanes.whole.scratch = &lanes.scratch[0];
  if (lanes.scratch[1].traverse.candidate) lanes.whole.helper = &lanes.scratch[1].traverse;
  lanes.whole.team = team;
  lanes.whole.anytime = anytime;
  lanes.two = alone != nullptr;
  for (int i = 0; i < 2; ++i) {
    lanes.single[i].scratch = &lanes.scratch[i];
    lanes.single[i].team = alone;
    lanes.single[i].anytime = anytime;
  }
}

void begin_lanes(Lanes& lanes, bool cold, double tick_ns) {
  for (Lane* lane : {&lanes.whole, &lanes.single[0], &lanes.single[1]}) {
    lane->cold = cold;
    lane->tick_ns = tick_ns;
    lane->report = {};
  }
}

void run_lanes(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
               std::span<ShellBody> shells, WeighShell weigh, h6FrameReport& report) {
  lanes.side_by_side = worth_two(lanes, shells);
  if (lanes.side_by_side) return run_side_by_side(lanes, set, bodies, shells, weigh, report);
  for (ShellBody& shell : shells) {
    const std::int64_t since = lanes.two ? sched::now_ns() : 0;
    weigh(set, bodies, shell, lanes.whole);
    if (lanes.two) shell.all_ns = static_cast<double>(sched::now_ns() - since);
  }
  join(report, lanes.whole.report);
  for (int stage = 0; stage < H6_STAGE_COUNT; ++stage)
    report.stage_us[stage] += lanes.whole.report.stage_us[stage];
}

}  // namespace h6
