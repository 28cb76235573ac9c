// SPDX-License-Identifier: Apache-2.0
// frame.cpp - one frame, on one page.
//
//   samples -> [traverse -> contacts -> weights -> wrench, K, D] -> coupling -> step -> output
//         each shell body against every field it can touch; bodies     each hand     safety, always
//         side by side or one after the other
//
// No allocation, lock, print, exception or wait in here or below; slices of work may run on the
// helper of `team`, joined in index order: any number of threads gives the same bits.
#include <algorithm>

#include "kernels/contact/contact_columns.h"
#include "runtime/frame/net_stiffness.h"
#include "runtime/frame/stages.h"
#include "sched/clock.h"
#include "sched/realtime.h"

namespace h6 {
namespace {

constexpr std::int64_t kRest = 50000;  // ns between frames from which others have used the caches

// A stage begins where the one before it ended: one reading each, not two.
struct Stopwatch {
  h6Session& s;
  std::int64_t last;  // [ticks]

  double ns_since(std::int64_t begin) const {
    return static_cast<double>(std::max<std::int64_t>(last - begin, 0)) * s.tick_length.ns();
  }

  template <class F>
  void timed(h6Stage stage, F&& work) {
    work();
    const std::int64_t begin = last;
    last = sched::ticks();
    s.report.stage_us[stage] += 1e-3 * ns_since(begin);
  }
};

void begin(h6Session& s, const h6DeviceSample* samples, std::int64_t start) {
  s.report = {};
  s.report.frame = s.frame++;
  s.rested = start - s.left_at > kRest;
  begin_anytime(s, start);
  for (std::size_t i = 0; i < s.body_count; ++i) {
    Body& body = s.bodies[i];
    body.f.setZero();
    clear(body.K);
    clear(body.D);
    if (!body.fixed) body.f.head<3>() = body.mass * s.gravity;
  }
  for (std::size_t i = 0; i < s.hand_count; ++i) {
    accept(s, s.hands[i], samples[i]);
    hold(s, s.hands[i]);
  }
}

// Before clusters are made of them: what is reported is how deep points are.
void note_depths(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    const Pair& pair = s.pairs[p];
    const double voxel = s.model->fields[s.bodies[pair.b].field].voxel;
    const Contacts& c = s.contacts[pair.a];
    const kernels::Depths depths =
        kernels::look_at_depths(c.depth + pair.begin, pair.end - pair.begin);
    const double deepest = depths.deepest;
    // The others are about to touch.
    s.report.contacts += static_cast<std::uint32_t>(depths.inside);
    s.report.max_depth = std::max(s.report.max_depth, deepest);
    s.report.max_depth_voxels = std::max(s.report.max_depth_voxels, deepest / voxel);
  }
}

// One shell body against all it can touch, up to the sums over its contacts: whoever weighed them
// has them in his cache.
void weigh_shell(h6Session& s, std::size_t first, std::size_t end) {
  Stopwatch watch{s, sched::ticks()};
  watch.timed(H6_STAGE_TRAVERSE, [&] { traverse(s, first, end); });
  const std::int64_t since = watch.last;
  watch.timed(H6_STAGE_CONTACTS, [&] {
    gather_contacts(s, first, end);
    note_depths(s, first, end);
  });
  watch.timed(H6_STAGE_WEIGHTS, [&] { weigh_contacts(s, first, end); });
  // Contacts too: their columns come back from the helper's cache.
  s.weighing.took(watch.ns_since(since));
  if (s.contact.method == H6_METHOD_SERIES) return;
  watch.timed(H6_STAGE_WRENCH, [&] {
    for (std::size_t p = first; p < end; ++p) sum_contacts(s, s.pairs[p]);
  });
}

// All of them: one after the other, each with both threads where that pays, or side by side.
void weigh_shells(h6Session& s) {
  s.in_lanes = worth_lanes(s);
  if (s.in_lanes) return run_lanes(s, weigh_shell);
  for (std::size_t i = 0; i < s.shell_count; ++i) {
    const std::int64_t since = s.lanes ? sched::now_ns() : 0;
    weigh_shell(s, s.shell_pairs[i], s.shell_pairs[i + 1]);
    if (s.lanes)
      s.bodies[s.pairs[s.shell_pairs[i]].a].shell_ns = static_cast<double>(sched::now_ns() - since);
  }
}

void add_shell(h6Session& s, std::size_t first, std::size_t end) {
  if (s.contact.method == H6_METHOD_SERIES) return sum_series(s, first, end);
  for (std::size_t p = first; p < end; ++p) add_wrench(s, s.pairs[p]);
}

// A timeline shows who did what.
void note_helper(h6Session& s, std::int64_t start) {
  const sched::FrameTeam::HelperWork helped = s.team->helper_work();
  if (!helped.slices) return;
  s.report.helper_start_us = 1e-3 * static_cast<double>(helped.first - start);
  s.report.helper_us = 1e-3 * static_cast<double>(helped.busy);
  s.report.helper_slices = helped.slices;
}

}  // namespace

h6Status frame(h6Session& s, const h6DeviceSample* samples, h6DeviceCommand* commands) {
  const sched::FlushDenormals flush;
  const std::int64_t start_ticks = sched::ticks(), start = sched::now_ns();
  s.tick_length.see(start, start_ticks);
  s.team->begin_frame(start);
  begin(s, samples, start);
  weigh_shells(s);
  Stopwatch watch{s, sched::ticks()};
  watch.timed(H6_STAGE_WRENCH, [&] {
    for (std::size_t i = 0; i < s.shell_count; ++i)
      add_shell(s, s.shell_pairs[i], s.shell_pairs[i + 1]);
  });
  watch.timed(H6_STAGE_COUPLING, [&] {
    for (std::size_t h = 0; h < s.hand_count; ++h) {
      couple(s, s.hands[h]);
      observe_hand(s, s.hands[h]);
    }
    if (s.contact.passivity) damp_contacts(s);
    if (s.net_stiffness) report_net_stiffness(s);
  });
  watch.timed(H6_STAGE_INTEGRATE, [&] {
    step_bodies(s);
    if (s.contact.passivity) observe_contacts(s);
  });
  watch.timed(H6_STAGE_OUTPUT, [&] {
    for (std::size_t h = 0; h < s.hand_count; ++h)
      send(s, s.hands[h], commands ? &commands[h] : nullptr);
  });
  learn_frame(s);
  s.report.passivity_energy = least_energy(s);
  s.report.state_hash = state_hash(s, samples);
  note_helper(s, start);
  watch.last = sched::ticks();
  const double took = watch.ns_since(start_ticks);
  s.report.frame_us = 1e-3 * took;
  s.left_at = start + static_cast<std::int64_t>(took);
  s.team->end_frame(start + static_cast<std::int64_t>(1e9 * s.dt));
  return s.report.status;
}

}  // namespace h6
