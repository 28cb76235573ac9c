// SPDX-License-Identifier: Apache-2.0
// find_contacts.cpp - finds the points of a shell body that are inside fields, pair by pair, and
// makes contacts from them.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "kernels/contact/keep_nearest.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/deformation.h"
#include "runtime/contact/traverse_pair.h"
#include "sched/clock.h"

namespace h6 {
namespace {

constexpr std::size_t kContactSlice = 512;  // contacts made at a time, in about 1.5 us
constexpr std::size_t kPairSlices = 32;

// The map from contact arms [m], from a's centre of mass along the world's axes, to voxels of b's
// field.
kernels::Affine arms_to_field(const Body& a, const Body& b) {
  const Field& field = *b.field;
  const Mat3 m = b.R.transpose() / field.voxel;
  const Vec3 t = m * (arm_origin(a) - (b.x - b.R * b.com)) - field.origin / field.voxel;
  kernels::Affine affine;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) affine.m[r][c] = static_cast<float>(m(r, c));
    affine.m[r][3] = static_cast<float>(t[r]);
  }
  return affine;
}

// Of the candidates of `pairs`, rows up to `count`, keeps the `most` with the least keys, in their
// order. Of equal keys the first ones stay. Returns the row behind the last.
std::size_t keep_least(const TraverseScratch& t, float* key, std::size_t count, std::size_t most,
                       PairList pairs) {
  std::size_t n = pairs[0].search.first;
  const kernels::Touching all = candidates_from(t, 0);
  const kernels::NearestLimit at = kernels::nearest_limit(key + n, count - n, most);
  std::size_t ties = most - at.below;
  for (Pair& pair : pairs) {
    PairSearch& found = pair.search;
    const std::size_t begin = found.first, end = begin + found.candidates;
    found.first = n;
    found.candidates = kernels::keep_nearest(all, key, begin, end, at.limit, ties, n);
    n += found.candidates;
  }
  return n;
}

// Ranks of candidates: a place's deepest ones, a cell's, all others; by depth within each. Keys of
// two ranks differ by more than depths do.
constexpr float kRank = 128, kDeepest = 60;  // [voxel]

void raise_rank(const TraverseScratch& t, std::size_t i, int ranks) {
  const float depth = std::clamp(t.candidate_distance[i], -kDeepest, kDeepest);
  t.key[i] = std::min(t.key[i], depth - kRank * static_cast<float>(ranks));
}

// One of 24 sectors of directions, by the largest component and the signs of all: no two directions
// of a sector are more than 60 degrees apart.
std::size_t sector_of(const Shell& shell, std::uint32_t row) {
  const float n[3] = {shell.nx[row], shell.ny[row], shell.nz[row]};
  std::size_t largest = 0, signs = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::fabs(n[k]) > std::fabs(n[largest])) largest = k;
    signs += std::size_t{n[k] < 0} << k;
  }
  return 8 * largest + signs;
}

// The deepest row of each cell is raised, and that of each block and sector of normals.
void rank_candidates(const Shell& shell, const TraverseScratch& t, std::size_t begin,
                     std::size_t end) {
  constexpr std::size_t kNone = SIZE_MAX;
  std::array<std::size_t, 24> of_block;
  of_block.fill(kNone);
  std::size_t of_cell = kNone;
  const auto deepest = [&](std::size_t i, std::size_t& best) {
    if (best == kNone || t.candidate_distance[i] < t.candidate_distance[best]) best = i;
  };
  const auto end_block = [&] {
    for (std::size_t& best : of_block)
      if (best != kNone) raise_rank(t, best, 2), best = kNone;
  };
  const auto end_cell = [&] {
    if (of_cell != kNone) raise_rank(t, of_cell, 1), of_cell = kNone;
  };
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t row = t.candidate[i], last = i > begin ? t.candidate[i - 1] : row;
    if (row / kBlockRows != last / kBlockRows) end_block();
    if (shell.cell[row] != shell.cell[last]) end_cell();
    t.key[i] = std::clamp(t.candidate_distance[i], -kDeepest, kDeepest);
    deepest(i, of_block[sector_of(shell, row)]);
    deepest(i, of_cell);
  }
  end_block();
  end_cell();
}

// Keeps `most` of the candidates of `pairs`, rows up to `count`, so that every place and direction
// keeps its deepest ones: METHOD.md, Sec. 6. It does not matter whether pairs are dropped from one
// after the other or all at once. Returns the row behind the last.
std::size_t keep_most(const Shell& shell, const TraverseScratch& t, std::size_t count,
                      std::size_t most, PairList pairs) {
  for (const Pair& pair : pairs)
    rank_candidates(shell, t, pair.search.first, pair.search.first + pair.search.candidates);
  return keep_least(t, t.key, count, most, pairs);
}

// If there is no time for more, keeps only a few of the coarse pairs' candidates. Returns how many
// candidates are left in all.
std::size_t keep_few(Anytime& anytime, const TraverseScratch& t, PairList all, std::size_t used) {
  const PairList pairs = all.last(coarse_pairs_of(anytime, all));
  if (pairs.empty()) return used;
  const std::size_t coarse = used - pairs[0].search.first;
  if (coarse <= Anytime::kFew || !must_be_few(anytime, all[0].search, used)) return used;
  used = keep_least(t, t.candidate_distance, used, Anytime::kFew, pairs);
  float least = -HUGE_VALF;  // the largest distance kept; no dropped point is deeper
  for (std::size_t i = pairs[0].search.first; i < used; ++i)
    least = std::max(least, t.candidate_distance[i]);
  for (Pair& pair : pairs) pair.search.missed = std::max(pair.search.missed, -least);
  return used;
}

std::size_t traverse_in_order(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                              Lane& lane) {
  TraverseScratch& t = lane.scratch->traverse;
  const std::size_t most = shell.contacts.capacity;
  std::size_t used = 0;
  for (std::size_t p = 0; p < shell.pairs.size(); ++p) {
    Pair& pair = shell.pairs[p];
    pair.search.first = used;
    pair.search.candidates =
        traverse_pair(set, bodies[shell.body], bodies[pair.b], pair.search, t, lane, used, false);
    used += pair.search.candidates;
    if (used > most) {
      used = keep_most(*bodies[shell.body].shell, t, used, most, shell.pairs.first(p + 1));
      lane.report.status |= H6_CONTACTS_DROPPED;
    }
  }
  return used;
}

// Each thread fills its own scratch; the results are joined in the order of pairs. Returns false if
// the scratch is too small, which happens only when contacts will be dropped. The caller can then
// repeat the traversal, because expiries stay valid.
bool traverse_shared(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                     Lane& lane, std::size_t* used) {
  TraverseScratch& mine = lane.scratch->traverse;
  for (Scratch& scratch : lane.scratches) scratch.traverse.used = 0;
  const Body& a = bodies[shell.body];
  const std::size_t pairs = shell.pairs.size(), slice = (pairs + kPairSlices - 1) / kPairSlices;
  const std::size_t room = kBlockRows * a.shell->blocks.count;
  std::atomic<bool> full{false};
  lane.team->for_slices((pairs + slice - 1) / slice, [&](std::size_t i) {
    const unsigned here = sched::FrameTeam::here();
    TraverseScratch& t = lane.scratches[here].traverse;
    const std::size_t end = std::min((i + 1) * slice, pairs);
    for (std::size_t p = i * slice; p < end; ++p) {
      if (t.used + room > t.capacity) return full.store(true, std::memory_order_relaxed);
      Pair& pair = shell.pairs[p];
      PairSearch& found = pair.search;
      found.found_by = here;
      found.first = t.used;
      found.candidates = traverse_pair(set, a, bodies[pair.b], found, t, lane, t.used, true);
      t.used += found.candidates;
    }
  });
  std::size_t end = 0;
  for (const Scratch& scratch : lane.scratches) end += scratch.traverse.used;
  if (full.load(std::memory_order_relaxed) || end > mine.capacity) return false;
  *used = end;
  // The loop begins with the last pair, so that the caller's own candidates only ever move up.
  for (std::size_t p = pairs; p-- > 0;) {
    PairSearch& pair = shell.pairs[p].search;
    end -= pair.candidates;
    move_candidates(mine, end, lane.scratches[pair.found_by].traverse, pair.first, pair.candidates);
    pair.first = end;
  }
  return true;
}

// On all threads where that is faster than to share the groups of one pair after the other. With a
// budget the clock decides pair after pair, in order.
std::size_t traverse_pairs(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                           Lane& lane) {
  const bool may = lane.scratches.size() > 1 && shell.pairs.size() > 1 && !lane.anytime->by_clock;
  if (!may) return traverse_in_order(set, bodies, shell, lane);
  const std::int64_t since = sched::now_ns();
  std::size_t used = 0;
  const bool shared = lane.pairing.share(shell.pairs.size());
  if (!shared || !traverse_shared(set, bodies, shell, lane, &used))
    used = traverse_in_order(set, bodies, shell, lane);
  lane.pairing.took(static_cast<double>(sched::now_ns() - since));
  return used;
}

}  // namespace

void traverse(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  const TraverseScratch& t = lane.scratch->traverse;
  const std::size_t most = shell.contacts.capacity;
  std::size_t used = traverse_pairs(set, bodies, shell, lane);
  used = keep_few(*lane.anytime, t, shell.pairs, used);
  if (used > most) {
    keep_most(*bodies[shell.body].shell, t, used, most, shell.pairs);
    lane.report.status |= H6_CONTACTS_DROPPED;
  }
  for (const Pair& pair : shell.pairs) {
    const Field& field = *bodies[pair.b].field;
    const double cut = field.voxel / field.finest;
    h6FrameReport& report = lane.report;
    report.missed_depth_voxels = std::max(report.missed_depth_voxels, cut * pair.search.missed);
    report.fit_depth_voxels = std::max(report.fit_depth_voxels, cut * pair.search.fit.deepest);
  }
}

void gather_contacts(std::span<const Body> bodies, ShellBody& shell, Lane& lane) {
  Contacts& c = shell.contacts;
  std::size_t rows = 0;
  for (const Pair& pair : shell.pairs) rows += pair.search.candidates;
  c.count = 0;
  place_columns(c, rows);
  const Body& a = bodies[shell.body];
  const Shell& points = *a.shell;
  const PointColumns now = points_of(a);
  const kernels::ShellColumns columns{
      now.x, now.y, now.z, now.nx, now.ny, now.nz, points.point.data};
  for (Pair& pair : shell.pairs) {
    PairSearch& found = pair.search;
    const Body& b = bodies[pair.b];
    const std::size_t first = c.count;
    pair.begin = pair.end = first;
    if (found.candidates == 0) continue;
    kernels::ContactFrame frame;
    Vec3 arm = a.R * (points.centre - a.com);
    if (a.bend) arm += a.x - a.bend->about;
    for (int k = 0; k < 9; ++k) {
      frame.Ra[k] = static_cast<float>(a.R(k / 3, k % 3));
      frame.Rb[k] = static_cast<float>(b.R(k / 3, k % 3));
    }
    for (int k = 0; k < 3; ++k) frame.arm[k] = static_cast<float>(arm[k]);
    frame.voxel = static_cast<float>(b.field->voxel);
    const std::uint32_t* const row = lane.scratch->traverse.candidate + found.first;
    const auto make = [&](std::size_t slice) {
      const std::size_t at = slice * kContactSlice, to = first + at;
      const std::size_t count = std::min(kContactSlice, found.candidates - at);
      kernels::make_contacts(columns, candidates_from(lane.scratch->traverse, found.first + at),
                             count, frame,
                             {c.depth + to, c.nx + to, c.ny + to, c.nz + to, c.gx + to, c.gy + to,
                              c.gz + to, c.rx + to, c.ry + to, c.rz + to, c.point + to});
      std::fill_n(c.field_body + to, count, pair.b);
      for (std::size_t i = 0; c.cell && i < count; ++i) c.cell[to + i] = points.cell[row[at + i]];
      if (a.bend) std::copy_n(row + at, count, a.bend->row + to);
    };
    share_slices(lane, lane.making, found.candidates,
                 (found.candidates + kContactSlice - 1) / kContactSlice, make);
    c.count += found.candidates;
    found.arms = arms_to_field(a, b);
    pair.end = c.count;
  }
}

}  // namespace h6
