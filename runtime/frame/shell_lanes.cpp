// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/shell_lanes.h"

#include <algorithm>
#include <new>

#include "runtime/frame/session.h"
#include "sched/clock.h"

namespace h6 {
namespace {

constexpr double kWorthSharing = 6000;  // ns that the other thread could take over
// One shell body with more than this share of the work is better shared within.
constexpr double kLopsided = 0.7;

h6Session& lane_of(h6Session& s, int thread) { return s.lanes[thread]; }

// How long both took for what: times of stages are those of the wall, in the proportion of the
// work.
void join_times(h6Session& s, double wall_us) {
  double work = 0;
  for (int i = 0; i < 2; ++i)
    for (const double us : lane_of(s, i).report.stage_us) work += us;
  for (int stage = 0; work > 0 && stage < H6_STAGE_COUNT; ++stage)
    s.report.stage_us[stage] +=
        wall_us / work *
        (lane_of(s, 0).report.stage_us[stage] + lane_of(s, 1).report.stage_us[stage]);
}

void join(h6FrameReport& to, const h6FrameReport& from) {
  to.status |= from.status;
  to.contacts += from.contacts;
  to.max_depth = std::max(to.max_depth, from.max_depth);
  to.max_depth_voxels = std::max(to.max_depth_voxels, from.max_depth_voxels);
  to.missed_depth_voxels = std::max(to.missed_depth_voxels, from.missed_depth_voxels);
  to.series_iterations = std::max(to.series_iterations, from.series_iterations);
  to.series_residual = std::max(to.series_residual, from.series_residual);
}

}  // namespace

void open_lanes(h6Session& s) {
  if (!s.lanes) return;
  for (int i = 0; i < 2; ++i) {
    h6Session& lane = *new (&s.lanes[i]) h6Session(s);
    lane.lanes = nullptr;
    lane.team = s.alone;
    lane.traversal[0] = s.traversal[i];
    lane.traversal[1] = {};
  }
  h6Session& second = s.lanes[1];
  second.cluster_order = s.lane_scratch.cluster_order;
  second.cluster_root = s.lane_scratch.cluster_root;
  second.cluster_cell = s.lane_scratch.cluster_cell;
  second.weigh_scratch = s.lane_scratch.weigh;
  second.slice_count = nullptr;
  second.slice_sum = nullptr;
}

bool worth_lanes(const h6Session& s) {
  // With a budget the clock decides pair after pair, in order.
  if (!s.lanes || s.anytime.by_clock) return false;
  double all = 0, most = 0;
  for (std::size_t i = 0; i < s.shell_count; ++i) {
    const double ns = s.bodies[s.pairs[s.shell_pairs[i]].a].shell_ns;
    all += ns;
    most = std::max(most, ns);
  }
  return all - most > (s.in_lanes ? 0.5 : 1.0) * kWorthSharing && most <= kLopsided * all;
}

void run_lanes(h6Session& s, ShellJob job) {
  const std::int64_t start = sched::ticks();
  for (int i = 0; i < 2; ++i) {
    h6Session& lane = lane_of(s, i);
    lane.report = {};
    lane.report.coarse_pairs = s.report.coarse_pairs;
    lane.anytime = s.anytime;
    lane.rested = s.rested;
    lane.tick_length = s.tick_length;
  }
  s.team->for_slices(s.shell_count, [&](std::size_t i) {
    const std::size_t first = s.shell_pairs[i], end = s.shell_pairs[i + 1];
    const std::int64_t since = sched::now_ns();
    job(lane_of(s, sched::FrameTeam::here()), first, end);
    s.bodies[s.pairs[first].a].shell_ns = static_cast<double>(sched::now_ns() - since);
  });
  for (int i = 0; i < 2; ++i) join(s.report, lane_of(s, i).report);
  // As the frame is timed: stages add up to no more.
  join_times(s, 1e-3 * s.tick_length.ns() * static_cast<double>(sched::ticks() - start));
}

}  // namespace h6
