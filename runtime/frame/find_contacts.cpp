// SPDX-License-Identifier: Apache-2.0
// find_contacts.cpp - the points of a shell body that are inside fields, pair by pair, and what
// their contacts are.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "kernels/contact/keep_nearest.h"
#include "runtime/frame/stages.h"
#include "runtime/frame/traverse_pair.h"
#include "sched/clock.h"

namespace h6 {
namespace {

constexpr std::size_t kContactSlice = 512;  // contacts made at a time: some 1.5 us
// Contacts from which making them is shared: what the other core made has to come over. 1,000 take
// 3.1 us alone and 6.2 with it, 10,000 46 and 26.
constexpr std::size_t kManyContacts = 4096;
constexpr double kPairsWorthSharing = 8000;  // ns of traversal from which pairs are shared out
constexpr std::size_t kPairSlices = 32;

// The same for arms: from a's centre of mass, along the axes of the world.
kernels::Affine arms_to_field(const Body& a, const Body& b, const Field& field) {
  const Mat3 m = b.R.transpose() / field.voxel;
  const Vec3 t = m * (a.x - (b.x - b.R * b.com)) - field.origin / field.voxel;
  kernels::Affine affine;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) affine.m[r][c] = static_cast<float>(m(r, c));
    affine.m[r][3] = static_cast<float>(t[r]);
  }
  return affine;
}

// Keeps the `most` deepest of the candidates of these pairs, up to `count`, in their order. Ties go
// to the first.
std::size_t keep_deepest(h6Session& s, std::size_t count, std::size_t most, Pair* pairs,
                         std::size_t pair_count) {
  std::size_t n = pairs[0].first;
  const kernels::Touching all = candidates_from(s.traversal[0], 0);
  const kernels::NearestLimit at = kernels::nearest_limit(all.distance + n, count - n, most);
  std::size_t ties = most - at.below;
  for (std::size_t p = 0; p < pair_count; ++p) {
    const std::size_t begin = pairs[p].first, end = begin + pairs[p].candidates;
    pairs[p].first = n;
    pairs[p].candidates = kernels::keep_nearest(all, begin, end, at.limit, ties, n);
    n += pairs[p].candidates;
  }
  return n;
}

// Where there is no time for the contacts of coarse pairs: the few deepest of them. Returns how
// many candidates there are then.
std::size_t keep_few(h6Session& s, std::size_t first_pair, std::size_t end_pair, std::size_t used) {
  const std::size_t first = std::max(
      first_pair, s.pair_count - std::min<std::size_t>(s.report.coarse_pairs, s.pair_count));
  if (first >= end_pair) return used;
  const std::size_t coarse = used - s.pairs[first].first;
  if (coarse <= Anytime::kFew || !must_be_few(s, first_pair, used)) return used;
  used = keep_deepest(s, used, Anytime::kFew, s.pairs + first, end_pair - first);
  float least = -HUGE_VALF;  // of the distances that are kept: what goes is no deeper
  for (std::size_t i = s.pairs[first].first; i < used; ++i)
    least = std::max(least, s.traversal[0].candidate_distance[i]);
  for (std::size_t p = first; p < end_pair; ++p)
    s.pairs[p].missed = std::max(s.pairs[p].missed, -least);
  return used;
}

std::size_t traverse_in_order(h6Session& s, std::size_t first_pair, std::size_t end_pair,
                              std::size_t most) {
  std::size_t used = 0;
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    pair.first = used;
    pair.candidates = traverse_pair(s, s.traversal[0], pair, used, false);
    used += pair.candidates;
    if (used > most) {
      used = keep_deepest(s, used, most, s.pairs + first_pair, p + 1 - first_pair);
      s.report.status |= H6_CONTACTS_DROPPED;
    }
  }
  return used;
}

// Is there enough for two, and enough pairs? One that has most of the work is shared within. With a
// budget the clock decides pair after pair, in order.
bool worth_sharing(const h6Session& s, const Body& a, std::size_t first_pair,
                   std::size_t end_pair) {
  if (!s.traversal[1].candidate || end_pair - first_pair < 2 || s.anytime.by_clock) return false;
  if (a.traverse_ns < (a.pairs_shared ? 0.5 * kPairsWorthSharing : kPairsWorthSharing))
    return false;
  std::size_t all = 0, most = 0;
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    all += s.pairs[p].sampled;
    most = std::max(most, s.pairs[p].sampled);
  }
  return most < kWorthSharing || 2 * most <= all;
}

// Every thread fills its own scratch; joined in the order of pairs. False: there is no room, as
// only where contacts will be dropped. Nothing is lost by then doing it again: expiries stay true.
bool traverse_shared(h6Session& s, std::size_t first_pair, std::size_t end_pair,
                     std::size_t* used) {
  TraverseScratch &mine = s.traversal[0], &helpers = s.traversal[1];
  mine.used = helpers.used = 0;
  const std::size_t pairs = end_pair - first_pair, slice = (pairs + kPairSlices - 1) / kPairSlices;
  std::atomic<bool> full{false};
  s.team->for_slices((pairs + slice - 1) / slice, [&](std::size_t i) {
    const int here = sched::FrameTeam::here();
    TraverseScratch& t = s.traversal[here];
    const std::size_t end = std::min(first_pair + (i + 1) * slice, end_pair);
    for (std::size_t p = first_pair + i * slice; p < end; ++p) {
      Pair& pair = s.pairs[p];
      const std::size_t room = kBlockRows * s.model->shells[s.bodies[pair.a].shell].blocks.count;
      if (t.used + room > s.candidate_capacity) return full.store(true, std::memory_order_relaxed);
      pair.found_by = here;
      pair.first = t.used;
      pair.candidates = traverse_pair(s, t, pair, t.used, true);
      t.used += pair.candidates;
    }
  });
  std::size_t end = mine.used + helpers.used;
  if (full.load(std::memory_order_relaxed) || end > s.candidate_capacity) return false;
  *used = end;
  // From the last one on: what is the caller's own only ever moves up.
  for (std::size_t p = end_pair; p-- > first_pair;) {
    Pair& pair = s.pairs[p];
    end -= pair.candidates;
    move_candidates(mine, end, s.traversal[pair.found_by], pair.first, pair.candidates);
    pair.first = end;
  }
  return true;
}

}  // namespace

void traverse(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  Body& a = s.bodies[s.pairs[first_pair].a];
  const std::size_t most = s.contacts[s.pairs[first_pair].a].capacity;
  const bool timed = s.traversal[1].candidate && end_pair - first_pair > 1;
  const std::int64_t since = timed ? sched::now_ns() : 0;
  std::size_t used = 0;
  a.pairs_shared =
      worth_sharing(s, a, first_pair, end_pair) && traverse_shared(s, first_pair, end_pair, &used);
  if (!a.pairs_shared) used = traverse_in_order(s, first_pair, end_pair, most);
  used = keep_few(s, first_pair, end_pair, used);
  if (used > most) {
    keep_deepest(s, used, most, s.pairs + first_pair, end_pair - first_pair);
    s.report.status |= H6_CONTACTS_DROPPED;
  }
  if (timed) a.traverse_ns = static_cast<double>(sched::now_ns() - since);
  for (std::size_t p = first_pair; p < end_pair; ++p)
    s.report.missed_depth_voxels =
        std::max<double>(s.report.missed_depth_voxels, s.pairs[p].missed);
}

void gather_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  Contacts& c = s.contacts[s.pairs[first_pair].a];
  c.count = 0;
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    const Shell& shell = s.model->shells[a.shell];
    const Field& field = s.model->fields[b.field];
    const std::size_t first = c.count;
    kernels::ContactFrame frame;
    const Vec3 arm = a.R * (shell.centre - a.com);
    for (int k = 0; k < 9; ++k) {
      frame.Ra[k] = static_cast<float>(a.R(k / 3, k % 3));
      frame.Rb[k] = static_cast<float>(b.R(k / 3, k % 3));
    }
    for (int k = 0; k < 3; ++k) frame.arm[k] = static_cast<float>(arm[k]);
    frame.voxel = static_cast<float>(field.voxel);
    const kernels::ShellColumns columns{shell.x.data,    shell.y.data,  shell.z.data,
                                        shell.nx.data,   shell.ny.data, shell.nz.data,
                                        shell.point.data};
    const bool many = pair.candidates >= kManyContacts;
    const std::size_t size = many ? kContactSlice : pair.candidates;
    const auto make = [&](std::size_t slice) {
      const std::size_t at = slice * size, to = first + at;
      kernels::make_contacts(columns, candidates_from(s.traversal[0], pair.first + at),
                             std::min(size, pair.candidates - at), frame,
                             {c.depth + to, c.nx + to, c.ny + to, c.nz + to, c.gx + to, c.gy + to,
                              c.gz + to, c.rx + to, c.ry + to, c.rz + to, c.point + to});
    };
    s.team->for_slices(many ? (pair.candidates + size - 1) / size : 1, make);
    c.count += pair.candidates;
    if (pair.candidates > 0) pair.arms = arms_to_field(a, b, field);
    pair.begin = first;
    std::fill_n(c.field_body + first, pair.candidates, pair.b);
    pair.end = c.count;
  }
}

}  // namespace h6
