// SPDX-License-Identifier: Apache-2.0
// frame.cpp - one frame, on one page.
//
//   samples -> near pairs -> [traverse -> contacts -> weights -> sums] -> wrench, K, D -> coupling
//              by boxes      each shell body against the fields near it; side by side   each hand
//   -> step -> output
//              safety, always
//
// From near pairs to step, all of this runs several times a frame where a body is fast near a
// field. The frame and all that it calls never allocate, lock, print, throw or wait. Slices of work
// may run on the team's helper and are joined in index order, so any number of threads gives the
// same bits.
#include <algorithm>

#include "kernels/contact/contact_columns.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/net_stiffness.h"
#include "runtime/frame/session.h"
#include "sched/clock.h"
#include "sched/realtime.h"

namespace h6 {
namespace {

constexpr std::int64_t kRest = 50000;  // after this pause the caches count as cold [ns]

// A stage begins when the previous one ends, so each needs only one reading of the clock.
struct Stopwatch {
  h6FrameReport& report;
  double tick_ns;
  std::int64_t last;  // [ticks]

  double ns_since(std::int64_t begin) const {
    return static_cast<double>(std::max<std::int64_t>(last - begin, 0)) * tick_ns;
  }

  template <class F>
  void timed(h6Stage stage, F&& work) {
    work();
    const std::int64_t begin = last;
    last = sched::ticks();
    report.stage_us[stage] += 1e-3 * ns_since(begin);
  }
};

void begin(h6Session& s, const h6DeviceSample* samples, std::int64_t start) {
  s.report = {};
  s.report.frame = s.frame++;
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    accept(s.devices[h], s.hands[h], s.bodies[s.hands[h].body], samples[h], s.settings.dt,
           s.report.status);
  for (Deformation& d : s.bends) follow(d, s.bodies);
  s.substeps = plan_substeps(s);
  s.report.substeps = s.substeps.count;
  if (s.substeps.needed > s.substeps.count)
    for (const Hand& hand : s.hands)
      if (s.bodies[hand.body].motion == Motion::held) s.report.status |= H6_SHORTENED;
  begin_anytime(s.anytime, start, s.substeps.count);
}

void begin_step(h6Session& s, std::uint32_t step, bool cold) {
  if (step == 1) decide_no_more(s.anytime);
  begin_lanes(s.lanes, cold && step == 0, s.tick_length.ns());
  s.report.contacts = 0;
  for (const std::uint32_t i : s.near.all_lively()) {
    const Body& body = s.bodies[i];
    s.acting[i].set_zero();
    if (!body.fixed) s.acting[i].f.head<3>() = body.mass * s.settings.gravity;
  }
  for (Hand& hand : s.hands) {
    Body& body = s.bodies[hand.body];
    hold(hand, body, share_of_way(s.substeps, body.motion == Motion::held, step));
  }
}

// Reports the depths of points, so it runs before points are merged into clusters.
void note_depths(std::span<const Body> bodies, ShellBody& shell, h6FrameReport& report) {
  for (Pair& pair : shell.pairs) {
    pair.touches = false;
    if (pair.begin == pair.end) continue;
    const kernels::Depths depths =
        kernels::look_at_depths(shell.contacts.depth + pair.begin, pair.end - pair.begin);
    // Not all rows count: `series` also has points that are about to touch.
    pair.touches = depths.inside > 0;
    report.contacts += static_cast<std::uint32_t>(depths.inside);
    report.max_depth = std::max<double>(report.max_depth, depths.deepest);
    report.max_depth_voxels =
        std::max(report.max_depth_voxels, depths.deepest / bodies[pair.b].field->finest);
  }
}

// Finds and weighs the contacts of one shell body. They are summed here too, because the thread
// that weighed them has them in its cache.
void weigh_shell(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  Stopwatch watch{lane.report, lane.tick_ns, sched::ticks()};
  watch.timed(H6_STAGE_TRAVERSE, [&] {
    look_ahead(set, bodies, shell);
    traverse(set, bodies, shell, lane);
  });
  const std::int64_t since = watch.last;
  watch.timed(H6_STAGE_CONTACTS, [&] {
    gather_contacts(bodies, shell, lane);
    note_depths(bodies, shell, lane.report);
  });
  watch.timed(H6_STAGE_WEIGHTS, [&] { weigh_contacts(set, bodies, shell, lane); });
  // The time includes the contacts stage, because its columns come back from the helper's cache.
  lane.weighing.took(watch.ns_since(since));
  watch.timed(H6_STAGE_WRENCH, [&] {
    sum_contacts(set, bodies, shell, lane);
    if (contacts_rub(set.contact)) sum_friction(set, bodies, shell, lane);
  });
}

// Finds the wrench on every body at its present pose. `first`: it is the first step of the frame.
void collide(h6Session& s, const Settings& set, bool first) {
  Stopwatch watch{s.report, s.tick_length.ns(), sched::ticks()};
  watch.timed(H6_STAGE_TRAVERSE, [&] {
    for (Deformation& d : s.bends) follow(d, s.bodies), d.touches = false;
    find_near_pairs(s);
    wake_pairs(s);
    begin_traversal(s.anytime, s.near.all_awake(), s.near.near_count, first);
  });
  run_lanes(s.lanes, set, s.bodies, s.near.all_active(), weigh_shell, s.report);
  watch.last = sched::ticks();
  watch.timed(H6_STAGE_WRENCH, [&] {
    for (ShellBody* shell : s.near.all_active()) add_wrenches(set, s.bodies, *shell, s.acting);
  });
}

// Couples the hands and moves the bodies. `last`: of the frame.
void couple_and_step(h6Session& s, const Settings& set, bool last) {
  h6Status& status = s.report.status;
  Stopwatch watch{s.report, s.tick_length.ns(), sched::ticks()};
  watch.timed(H6_STAGE_COUPLING, [&] {
    for (std::size_t h = 0; h < s.hands.size(); ++h) {
      Hand& hand = s.hands[h];
      couple(set, hand, s.bodies[hand.body], s.acting[hand.body], status);
      // A port starts from what is stored before the first step moves anything.
      if (last || !s.devices[h].port.known())
        observe_hand(set, s.bodies, s.shells, hand, s.devices[h]);
    }
    if (s.substeps.count > 1 && set.integrator == H6_IMPLICIT)
      stop_impacts(set, s.bodies, s.shells, s.acting);
    if (set.contact.passivity) damp_contacts(set, s.bodies, s.shells, s.acting, s.hands, status);
    if (set.net_stiffness && last) report_net_stiffness(s.bodies, s.shells, s.report);
  });
  watch.timed(H6_STAGE_INTEGRATE, [&] {
    fold_bends(set, s.bodies, s.bends, s.acting, status);
    for (const Hand& hand : s.hands) {
      Body& body = s.bodies[hand.body];
      if (body.motion == Motion::quasi_static && hand.seen)
        step_static(set, body, s.acting[hand.body], body.max_step / s.substeps.count, status);
    }
    accelerate_bodies(set, s.bodies, s.acting, s.shells, s.islands, status);
    accelerate_bends(set, s.bodies, s.bends);
    if (slow_down(s, set.dt)) status |= H6_SHORTENED;
    move_bodies(set, s.bodies, s.islands, status);
    move_bends(s.bends, status);
    if (set.contact.passivity) observe_contacts(set, s.bodies, s.shells);
  });
}

// The hands feel the mean over the steps of a frame: it is the impulse that their bodies got.
class MeanWrench {
 public:
  explicit MeanWrench(std::span<Hand> hands) : hands_(hands) {}
  void add() {
    for (std::size_t h = 0; h < hands_.size(); ++h)
      sum_[h] = count_ ? Vec6(sum_[h] + hands_[h].wrench) : hands_[h].wrench;
    ++count_;
  }
  void take() {
    for (std::size_t h = 0; h < hands_.size(); ++h) hands_[h].wrench = sum_[h] / count_;
  }

 private:
  std::span<Hand> hands_;
  Vec6 sum_[H6_MAX_HANDS];
  int count_ = 0;
};

// Records the helper's work for the timeline.
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
  h6Status& status = s.report.status;
  s.tick_length.see(start, start_ticks);
  s.team->begin_frame(start);
  begin(s, samples, start);
  Settings set = s.settings;
  set.dt /= s.substeps.count;
  MeanWrench felt(s.hands);
  for (std::uint32_t step = 0; step < s.substeps.count; ++step) {
    begin_step(s, step, start - s.left_at > kRest);
    collide(s, set, step == 0);
    couple_and_step(s, set, step + 1 == s.substeps.count);
    felt.add();
  }
  felt.take();
  Stopwatch watch{s.report, s.tick_length.ns(), sched::ticks()};
  watch.timed(H6_STAGE_OUTPUT, [&] {
    for (std::size_t h = 0; h < s.hands.size(); ++h)
      send(s.devices[h], s.hands[h], s.bodies[s.hands[h].body], s.settings.dt,
           commands ? &commands[h] : nullptr, status);
  });
  learn_frame(s.anytime, s.report);
  report_anytime(s.anytime, s.report);
  s.report.passivity_energy = least_energy(set, s.shells, s.devices);
  s.report.state_hash = state_hash(s, samples);
  note_helper(s, start);
  watch.last = sched::ticks();
  const double took = watch.ns_since(start_ticks);
  s.report.frame_us = 1e-3 * took;
  s.left_at = start + static_cast<std::int64_t>(took);
  s.team->end_frame(start + static_cast<std::int64_t>(1e9 * s.settings.dt));
  return s.report.status;
}

}  // namespace h6
