// SPDX-License-Identifier: Apache-2.0
// start_overlap.cpp - measures how deep shells are inside fields at the start, by one traversal of
// each pair. METHOD.md, Sec. 7.
#include "runtime/frame/start_overlap.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/traverse_pair.h"
#include "runtime/frame/name_contacts.h"
#include "runtime/frame/session.h"
#include "runtime/frame/workers.h"
#include "sched/host_memory.h"
#include "sched/realtime.h"

namespace h6 {
namespace {

// The points of one pair that are inside, in the order of rows.
struct Measured {
  Pair* pair;
  const Body &a, &b;
  sched::HostVector<h6OverlapPoint> points;
  sched::HostVector<std::uint32_t> rows;
  sched::HostVector<float> depths;  // [voxel]
};

h6OverlapPoint point_at(const Body& a, const Pair& pair, const Field& field,
                        const kernels::Affine& place, std::uint32_t row, float depth) {
  const Shell& shell = *a.shell;
  const PointColumns now = points_of(a);
  const float p[3] = {now.x[row], now.y[row], now.z[row]};
  float at[3];
  for (int k = 0; k < 3; ++k) {
    const float* m = place.m[k];
    at[k] = m[0] * p[0] + (m[1] * p[1] + (m[2] * p[2] + m[3]));
  }
  const NamedPlace name = name_place(field, at);
  h6OverlapPoint out{};
  out.shell_body = pair.a, out.field_body = pair.b;
  out.point = shell.point[row];
  out.part = name.part, out.triangle = name.triangle;
  out.position = to(Vec3(a.x + a.R * (Vec3(p[0], p[1], p[2]) + shell.centre - a.com)));
  out.depth_voxels = depth;
  out.depth = depth * field.voxel;
  return out;
}

// One traversal that finds all points with a distance below zero. What the search remembered is
// forgotten afterwards, so a frame does the same work as if there had been none.
Measured measure_pair(h6Session& s, const Settings& set, Pair& pair) {
  Measured found{&pair, s.bodies[pair.a], s.bodies[pair.b], {}, {}, {}};
  PairSearch& search = pair.search;
  const PairSearch before = search;
  search.travelled = -1;
  search.number = 0;
  search.cull_blocks = search.cull_groups = search.pick_rows = {};
  search.fit = {};
  TraverseScratch& t = s.lanes.scratch[0].traverse;
  const std::size_t n = traverse_pair(set, found.a, found.b, search, t, s.lanes.whole, 0, true);
  const kernels::Touching inside = candidates_from(t, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (!(inside.distance[i] < 0)) continue;
    found.rows.push_back(inside.row[i]);
    found.depths.push_back(-inside.distance[i]);
    found.points.push_back(point_at(found.a, pair, *found.b.field, search.last_place, inside.row[i],
                                    -inside.distance[i]));
  }
  search = before;
  search.travelled = -1;
  search.quiet.way = 0;
  return found;
}

sched::HostVector<Measured> measure(h6Session& s) {
  const sched::FlushDenormals flush;
  Settings set = s.settings;
  set.contact.method = H6_METHOD_NONE;  // without a margin
  set.contact.fit_offset = 0;
  s.anytime.by_clock = false;
  s.anytime.coarse_pairs = 0;
  find_near_pairs(s);
  begin_traversal(s.anytime, {}, s.near.near_count, true);
  sched::HostVector<Measured> all;
  for (const NearPairs::Near& near : s.near.all_near()) {
    Pair& pair = s.near.pairs[near.slot];
    if (!overlap(s.near.places[pair.a].shell, s.near.places[pair.b].field)) continue;
    Measured found = measure_pair(s, set, pair);
    if (!found.points.empty()) all.push_back(std::move(found));
  }
  return all;
}

// Called twice, like the layout of a session.
void lay_out_overlap(StartOverlap& to, float*& relief, std::uint32_t*& rows, Arena& arena) {
  to.pairs = arena.take<h6Overlap>(to.pair_count);
  to.points = arena.take<h6OverlapPoint>(to.point_count);
  to.rows = arena.take<std::uint32_t>(to.point_count);
  rows = arena.take<std::uint32_t>(to.point_count);
  relief = arena.take<float>(to.point_count);
}

h6Overlap sum_up(const Measured& found, std::size_t first) {
  const auto deepest = std::max_element(found.depths.begin(), found.depths.end());
  const auto at = static_cast<std::size_t>(deepest - found.depths.begin());
  const h6OverlapPoint& p = found.points[at];
  return {p.shell_body, p.field_body,   static_cast<std::uint32_t>(found.points.size()), 0,
          p.depth,      p.depth_voxels, static_cast<std::uint32_t>(first + at),          {}};
}

// The relief with which a point's first distance, offset included, is zero to the bit. Where the
// field knows only bounds there is no zero, and the point takes no part until it is free.
void set_relief(PairFit& fit, const Measured& found, const h6ContactDef& set, std::uint32_t* rows,
                float* relief) {
  const Field& field = *found.b.field;
  const float offset = static_cast<float>(set.fit_offset / field.voxel);
  const float deepest = std::min(static_cast<float>(H6_DEEPEST_FIT), field.view.band);
  fit = {rows, relief, 0, 0};
  for (std::size_t i = 0; i < found.rows.size(); ++i) {
    const float depth = -(-found.depths[i] + offset);
    if (!(depth > 0)) continue;
    fit.row[fit.count] = found.rows[i];
    fit.relief[fit.count++] = found.depths[i] > deepest ? HUGE_VALF : depth;
  }
}

void store(h6Session& s, const sched::HostVector<Measured>& all, std::uint32_t* rows,
           float* relief) {
  StartOverlap& to = s.overlap;
  std::size_t pair = 0, row = 0;
  for (const NearPairs::Near& near : s.near.all_near()) s.near.pairs[near.slot].search.fit = {};
  for (const Measured& found : all) {
    to.pairs[pair++] = sum_up(found, row);
    std::copy(found.points.begin(), found.points.end(), to.points + row);
    std::copy(found.rows.begin(), found.rows.end(), to.rows + row);
    if (s.settings.contact.fit == H6_FIT_RELIEVE)
      set_relief(found.pair->search.fit, found, s.settings.contact, rows + row, relief + row);
    row += found.points.size();
  }
}

// The relief that is left in an overlap. A pair that is no longer near has none.
PairFit fit_of(const h6Session& s, const h6Overlap& o) {
  const Pair* pair = find_near_pair(s, o.shell_body, o.field_body);
  return pair ? pair->search.fit : PairFit{};
}

// Keeps the rows of `fit` that `had` has too, with the relief that they have there.
void keep_common(PairFit& fit, const PairFit& had) {
  std::size_t kept = 0, at = 0;
  for (std::size_t i = 0; i < fit.count; ++i) {
    while (at < had.count && had.row[at] < fit.row[i]) ++at;
    if (at == had.count || had.row[at] != fit.row[i]) continue;
    fit.row[kept] = fit.row[i];
    fit.relief[kept++] = had.relief[at];
  }
  fit.count = kept;
}

}  // namespace

bool measure_overlap(h6Session& s, h6Error* error) {
  const sched::HostVector<Measured> all = measure(s);
  StartOverlap next;
  next.pair_count = all.size();
  for (const Measured& found : all) next.point_count += found.points.size();
  std::uint32_t* rows = nullptr;
  float* relief = nullptr;
  if (next.point_count > 0) {
    Arena count;
    lay_out_overlap(next, relief, rows, count);
    next.memory_bytes = count.used();
    next.memory = allocate(s.allocator, next.memory_bytes);
    if (!next.memory)
      return fail(error, H6_ERROR_MEMORY, "no memory for the overlap at the start (%zu points)",
                  next.point_count);
    Arena arena(next.memory, next.memory_bytes);
    lay_out_overlap(next, relief, rows, arena);
  }
  forget_overlap(s);
  s.overlap = next;
  store(s, all, rows, relief);
  return true;
}

void forget_relief(h6Session& s, std::int32_t body) {
  for (const NearPairs::Near& near : s.near.all_near()) {
    Pair& pair = s.near.pairs[near.slot];
    if (pair.a == body || pair.b == body) pair.search.fit = {};
  }
}

void forget_overlap(h6Session& s) {
  release(s.allocator, s.overlap.memory, s.overlap.memory_bytes);
  s.overlap = {};
}

void take_over_relief(h6Session& next, const h6Session& before) {
  for (const NearPairs::Near& near : next.near.all_near()) {
    Pair& pair = next.near.pairs[near.slot];
    const Pair* had = find_near_pair(before, pair.a, pair.b);
    keep_common(pair.search.fit, had ? had->search.fit : PairFit{});
  }
}

}  // namespace h6

using namespace h6;

extern "C" {

size_t h6GetOverlaps(const h6Session* session, h6Overlap* out, size_t capacity) {
  if (!session) return 0;
  const StartOverlap& all = session->overlap;
  if (!out) capacity = 0;
  for (std::size_t i = 0; i < std::min(capacity, all.pair_count); ++i) {
    out[i] = all.pairs[i];
    out[i].relieved = static_cast<std::uint32_t>(fit_of(*session, out[i]).count);
  }
  return all.pair_count;
}

size_t h6GetOverlapPoints(const h6Session* session, h6OverlapPoint* out, size_t capacity) {
  if (!session) return 0;
  const h6Session& s = *session;
  const StartOverlap& all = s.overlap;
  if (!out) capacity = 0;
  const std::size_t count = std::min(capacity, all.point_count);
  std::copy_n(all.points, count, out);
  std::size_t row = 0;
  for (std::size_t i = 0; i < all.pair_count; ++i) {
    const PairFit fit = fit_of(s, all.pairs[i]);
    const double voxel = s.bodies[all.pairs[i].field_body].field->voxel;
    const std::size_t end = row + all.pairs[i].points;
    for (std::size_t at = 0; row < end; ++row) {
      while (at < fit.count && fit.row[at] < all.rows[row]) ++at;
      if (row < count && at < fit.count && fit.row[at] == all.rows[row])
        out[row].relief = voxel * fit.relief[at];
    }
  }
  return all.point_count;
}

bool h6RestartFit(h6Session* session, h6Error* error) {
  if (!session) return fail(error, "no session was given");
  if (run_by_loop(*session)) return fail(error, H6_ERROR_BUSY, "a loop runs this session");
  const Turn turn(session->workers);
  if (!turn) return fail(error, H6_ERROR_BUSY, "the session's workers are stepping others");
  const sched::HostScope scope(session->allocator);
  try {
    return measure_overlap(*session, error);
  } catch (const std::exception& e) {
    return fail(error, H6_ERROR_MEMORY, "the overlap could not be measured: %s", e.what());
  }
}

}  // extern "C"
