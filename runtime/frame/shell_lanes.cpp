// SPDX-License-Identifier: Apache-2.0
// shell_lanes.cpp - weighs shell bodies one after the other, or several at a time.
#include "runtime/frame/shell_lanes.h"

#include <algorithm>

#include "sched/clock.h"

namespace h6 {
namespace {

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

// The stages of lanes overlap. Each stage is reported with its share of the wall time, in
// proportion to its work, so that the stages of a frame add up to no more than the frame.
void join_times(const Lanes& lanes, double wall_us, h6FrameReport& report) {
  double work = 0;
  for (const Lane& lane : lanes.single)
    for (const double us : lane.report.stage_us) work += us;
  for (const Lane& lane : lanes.single)
    for (int stage = 0; work > 0 && stage < H6_STAGE_COUNT; ++stage)
      report.stage_us[stage] += wall_us / work * lane.report.stage_us[stage];
}

void run_side_by_side(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
                      std::span<ShellBody* const> shells, WeighShell weigh, h6FrameReport& report) {
  const std::int64_t start = sched::ticks();
  lanes.whole.team->for_slices(shells.size(), [&](std::size_t i) {
    weigh(set, bodies, *shells[i], lanes.single[sched::FrameTeam::here()]);
  });
  for (const Lane& lane : lanes.single) join(report, lane.report);
  const double took = lanes.whole.tick_ns * static_cast<double>(sched::ticks() - start);
  join_times(lanes, 1e-3 * took, report);
}

void run_in_order(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
                  std::span<ShellBody* const> shells, WeighShell weigh, h6FrameReport& report) {
  for (ShellBody* shell : shells) weigh(set, bodies, *shell, lanes.whole);
  join(report, lanes.whole.report);
  for (int stage = 0; stage < H6_STAGE_COUNT; ++stage)
    report.stage_us[stage] += lanes.whole.report.stage_us[stage];
}

}  // namespace

void open_lanes(Lanes& lanes, sched::FrameTeam* team, sched::FrameTeam* alone, Anytime* anytime) {
  lanes.whole.scratch = &lanes.scratch[0];
  lanes.whole.scratches = lanes.scratch;
  lanes.whole.team = team;
  lanes.whole.anytime = anytime;
  for (std::size_t i = 0; i < lanes.single.size(); ++i) {
    lanes.single[i].scratch = &lanes.scratch[i];
    lanes.single[i].team = alone;
    lanes.single[i].anytime = anytime;
  }
}

void borrow(Lanes& lanes, Scratch& scratch) {
  lanes.scratch = {&scratch, 1};
  lanes.whole.scratch = &scratch;
  lanes.whole.scratches = lanes.scratch;
}

void begin_lanes(Lanes& lanes, bool cold, double tick_ns) {
  const auto begin = [&](Lane& lane) {
    lane.cold = cold;
    lane.tick_ns = tick_ns;
    lane.report = {};
  };
  begin(lanes.whole);
  for (Lane& lane : lanes.single) begin(lane);
}

void run_lanes(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
               std::span<ShellBody* const> shells, WeighShell weigh, h6FrameReport& report) {
  // With a budget the clock decides pair after pair, in order.
  const bool may = shells.size() > 1 && !lanes.single.empty() && !lanes.whole.anytime->by_clock;
  if (!may) return run_in_order(lanes, set, bodies, shells, weigh, report);
  const std::int64_t since = sched::now_ns();
  if (lanes.bodies.share(shells.size()))
    run_side_by_side(lanes, set, bodies, shells, weigh, report);
  else
    run_in_order(lanes, set, bodies, shells, weigh, report);
  lanes.bodies.took(static_cast<double>(sched::now_ns() - since));
}

}  // namespace h6
