// SPDX-License-Identifier: Apache-2.0
// start_overlap.cpp - measures how deep shells are inside fields at the start, by one traversal of
// each pair. METHOD.md, Sec. 7.
#include "runtime/frame/start_overlap.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/contact/traverse_pair.h"
#include "runtime/frame/name_contacts.h"
#include "runtime/frame/session.h"
#include "sched/realtime.h"

namespace h6 {
namespace {

// The points of one pair that are inside, in the order of rows.
struct Measured {
  const Body &a, &b;
  std::vector<h6OverlapPoint> points;
  std::vector<std::uint32_t> rows;
  std::vector<float> depths;  // [voxel]
};

h6OverlapPoint point_at(const Body& a, const Pair& pair, const Field& field,
                        const kernels::Affine& place, std::uint32_t row, float depth) {
  const Shell& shell = *a.shell;
  const float p[3] = {shell.x[row], shell.y[row], shell.z[row]};
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
Measured measure_pair(h6Session& s, const Settings& set, const Pair& pair, PairSearch& search) {
  Measured found{s.bodies[pair.a], s.bodies[pair.b], {}, {}, {}};
  const PairSearch before = search;
  search.travelled = -1;
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
  return found;
}

bool offset_fits(const Field& field, const h6ContactDef& contact, std::int32_t body,
                 h6Error* error) {
  const double offset = contact.fit_offset / field.voxel;
  return offset <= H6_DEEPEST_FIT ||
         fail(error, "contact fit_offset is %g mm, which is %.1f voxels of body %d: at most %g",
              1e3 * contact.fit_offset, offset, body, H6_DEEPEST_FIT);
}

bool measure(h6Session& s, std::vector<Measured>& all, h6Error* error) {
  const sched::FlushDenormals flush;
  Settings set = s.settings;
  set.contact.method = H6_METHOD_NONE;  // without a margin
  set.contact.fit_offset = 0;
  s.anytime.by_clock = false;
  s.anytime.coarse_pairs = 0;
  for (ShellBody& shell : s.shells)
    for (std::size_t p = 0; p < shell.pairs.size(); ++p) {
      const std::int32_t b = shell.pairs[p].b;
      if (!offset_fits(*s.bodies[b].field, s.settings.contact, b, error)) return false;
      all.push_back(measure_pair(s, set, shell.pairs[p], shell.searches[p]));
    }
  return true;
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
          p.depth,      p.depth_voxels, static_cast<std::uint32_t>(first + at)};
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

void store(h6Session& s, const std::vector<Measured>& all, std::uint32_t* rows, float* relief) {
  StartOverlap& to = s.overlap;
  std::size_t pair = 0, row = 0, next = 0;
  for (ShellBody& shell : s.shells)
    for (PairSearch& search : shell.searches) {
      const Measured& found = all[next++];
      search.fit = {};
      if (found.points.empty()) continue;
      to.pairs[pair++] = sum_up(found, row);
      std::copy(found.points.begin(), found.points.end(), to.points + row);
      std::copy(found.rows.begin(), found.rows.end(), to.rows + row);
      if (s.settings.contact.fit == H6_FIT_RELIEVE)
        set_relief(search.fit, found, s.settings.contact, rows + row, relief + row);
      row += found.points.size();
    }
}

// The search of the pair that overlap `i` is of.
const PairSearch& search_of(const h6Session& s, const h6Overlap& o) {
  const ShellBody& shell = *find_shell(s, o.shell_body);
  std::size_t p = 0;
  while (shell.pairs[p].b != o.field_body) ++p;
  return shell.searches[p];
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
  std::vector<Measured> all;
  if (!measure(s, all, error)) return false;
  StartOverlap next;
  for (const Measured& found : all) {
    next.pair_count += !found.points.empty();
    next.point_count += found.points.size();
  }
  std::uint32_t* rows = nullptr;
  float* relief = nullptr;
  if (next.point_count > 0) {
    Arena count;
    lay_out_overlap(next, relief, rows, count);
    next.memory_bytes = count.used();
    next.memory = allocate(s.allocator, next.memory_bytes);
    if (!next.memory)
      return fail(error, "no memory for the overlap at the start (%zu points)", next.point_count);
    Arena arena(next.memory, next.memory_bytes);
    lay_out_overlap(next, relief, rows, arena);
  }
  forget_overlap(s);
  s.overlap = next;
  store(s, all, rows, relief);
  return true;
}

void forget_relief(h6Session& s, std::int32_t body) {
  for (ShellBody& shell : s.shells)
    for (std::size_t p = 0; p < shell.pairs.size(); ++p)
      if (shell.body == body || shell.pairs[p].b == body) shell.searches[p].fit = {};
}

void forget_overlap(h6Session& s) {
  release(s.allocator, s.overlap.memory, s.overlap.memory_bytes);
  s.overlap = {};
}

void take_over_relief(h6Session& next, const h6Session& before) {
  for (ShellBody& shell : next.shells)
    for (std::size_t p = 0; p < shell.pairs.size(); ++p) {
      PairFit had;
      if (const ShellBody* old = find_shell(before, shell.body))
        for (std::size_t q = 0; q < old->pairs.size(); ++q)
          if (old->pairs[q].b == shell.pairs[p].b) had = old->searches[q].fit;
      keep_common(shell.searches[p].fit, had);
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
    out[i].relieved = static_cast<std::uint32_t>(search_of(*session, out[i]).fit.count);
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
    const PairFit& fit = search_of(s, all.pairs[i]).fit;
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
  try {
    return measure_overlap(*session, error);
  } catch (const std::exception& e) {
    return fail(error, "the overlap could not be measured: %s", e.what());
  }
}

}  // extern "C"
