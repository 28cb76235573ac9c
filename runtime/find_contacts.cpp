// find_contacts.cpp - which points of a shell are inside a field, and what their contacts are.
//
// Xu & Barbic 2016, Sec. 3 after McNeely 1999: a sphere whose signed distance exceeds its radius is
// dropped with all its points. Here in flat tiers, and a sphere that was dropped stays so until the
// shell has moved as far as it was clear. METHOD.md, Sec. 6.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "kernels/cull_spheres.h"
#include "kernels/expiry.h"
#include "kernels/touch_groups.h"
#include "runtime/anytime.h"
#include "runtime/stages.h"
#include "sched/clock.h"

namespace h6 {
namespace {

constexpr std::size_t kWorthSharing = 80;   // groups from which the helper is asked: some 6 us
constexpr std::size_t kContactSlice = 512;  // contacts made at a time: some 1.5 us
// Contacts from which making them is shared: what the other core made has to come over. 1,000 take
// 3.1 us alone and 6.2 with it, 10,000 46 and 26.
constexpr std::size_t kManyContacts = 4096;
constexpr double kPairsWorthSharing = 8000;  // ns of traversal from which pairs are shared out
constexpr std::size_t kPairSlices = 32;
constexpr float kSlack = 1e-3f;        // [voxel]
constexpr std::size_t kFewGroups = 4;  // of a block: looked at sooner than the block's sphere
constexpr double kLongestWay = 256;    // [voxel] float has 3e-5 left there

// Shell coordinates (relative to its centre, metres) to voxels of the field: made in double.
kernels::Affine shell_to_field(const Body& a, const Shell& shell, const Body& b,
                               const Field& field) {
  const Mat3 m = b.R.transpose() * a.R / field.voxel;
  const Vec3 b_mesh = b.x - b.R * b.com;  // origin of b's mesh frame in the world
  const Vec3 centre = a.x + a.R * (shell.centre - a.com);
  const Vec3 t = (b.R.transpose() * (centre - b_mesh) - field.origin) / field.voxel;
  kernels::Affine affine;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) affine.m[r][c] = static_cast<float>(m(r, c));
    affine.m[r][3] = static_cast<float>(t[r]);
  }
  return affine;
}

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

// `series` needs the points that are about to touch. [voxel]
float margin_of(const h6Session& s) {
  return s.contact.method == H6_METHOD_SERIES ? static_cast<float>(s.contact.margin_voxels) : 0.0f;
}

// Is the distance there a sample? Far from the surface it is only a bound, and no gap can be told.
bool is_sampled(const kernels::FieldView& field, const kernels::Affine& to_field, float x, float y,
                float z) {
  std::int32_t brick[3];
  for (int k = 0; k < 3; ++k) {
    const float* m = to_field.m[k];
    const float q = m[0] * x + (m[1] * y + (m[2] * z + m[3]));
    if (!(q >= 0 && q <= static_cast<float>(8 * field.size[k] - 1))) return false;
    brick[k] = std::min(static_cast<std::int32_t>(q), 8 * field.size[k] - 2) / 8;
  }
  return field.table[(brick[2] * field.size[1] + brick[1]) * field.size[0] + brick[0]] >= 0;
}

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at) {
  return {t.candidate + at, t.candidate_distance + at, t.gradient_x + at, t.gradient_y + at,
          t.gradient_z + at};
}

// From one's scratch to another's, or within one; the two may overlap.
void move_candidates(const TraverseScratch& to, std::size_t to_row, const TraverseScratch& from,
                     std::size_t from_row, std::size_t count) {
  const kernels::Touching a = candidates_from(to, to_row), b = candidates_from(from, from_row);
  if (a.row == b.row || count == 0) return;
  std::memmove(a.row, b.row, count * sizeof *a.row);
  std::memmove(a.distance, b.distance, count * sizeof *a.distance);
  std::memmove(a.gx, b.gx, count * sizeof *a.gx);
  std::memmove(a.gy, b.gy, count * sizeof *a.gy);
  std::memmove(a.gz, b.gz, count * sizeof *a.gz);
}

// What one traversal needs of a pair.
struct Search {
  const kernels::FieldView& field;
  const Shell& shell;
  kernels::Affine place;
  float scale;  // voxels a metre
  bool wide;
  float margin;  // [voxel]
  bool cold;     // after a pause others have had the caches

  std::size_t cull(const Tier& tier, const std::uint32_t* rows, std::size_t count,
                   std::uint32_t* survivors, float* clearance) const {
    return kernels::cull_spheres(
        field, place, {tier.x.data, tier.y.data, tier.z.data, tier.radius.data, tier.count}, scale,
        wide, margin, rows, 0, count, survivors, clearance);
  }
  // Samples that stand in `vectors`; `out` names rows of the shell as ever.
  std::size_t touch_samples(const std::uint32_t* vectors, std::size_t count,
                            const kernels::Touching& out, float* least) const {
    const Samples& samples = shell.samples;
    const std::size_t found = kernels::touch_groups(
        field, place, {samples.x.data, samples.y.data, samples.z.data, samples.x.count}, vectors,
        count, margin, cold, out, least);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < found; ++k) {
      const std::uint32_t row = samples.row[out.row[k]];
      if (row == Samples::kNoRow) continue;
      if (kept != k) {
        out.distance[kept] = out.distance[k];
        out.gx[kept] = out.gx[k], out.gy[kept] = out.gy[k], out.gz[kept] = out.gz[k];
      }
      out.row[kept++] = row;
    }
    return kept;
  }
  std::size_t touch(const std::uint32_t* groups, std::size_t count, const kernels::Touching& out,
                    float* least) const {
    return kernels::touch_groups(field, place,
                                 {shell.x.data, shell.y.data, shell.z.data, shell.points}, groups,
                                 count, margin, cold, out, least);
  }
};

// Points of `groups` that touch, in order, whatever runs the slices. Behind `used`. `alone`: this
// is a slice itself.
std::size_t touch(h6Session& s, TraverseScratch& t, const Search& search, std::size_t count,
                  std::size_t used, bool alone) {
  const auto by_myself = [&] {
    return search.touch(t.survivors, count, candidates_from(t, used), t.clearance);
  };
  if (alone || count < kWorthSharing || s.team->threads() == 1) return by_myself();
  const std::int64_t since = sched::now_ns();
  const auto timed = [&](std::size_t found) {
    s.touching.took(static_cast<double>(sched::now_ns() - since));
    return found;
  };
  if (!s.touching.share(count)) return timed(by_myself());
  const std::size_t slices = (count + kTouchSlice - 1) / kTouchSlice;
  s.team->for_slices(slices, [&](std::size_t i) {
    const std::size_t at = i * kTouchSlice, n = std::min(kTouchSlice, count - at);
    s.slice_count[i] = search.touch(t.survivors + at, n, candidates_from(t, used + at * kGroupRows),
                                    t.clearance + at);
  });
  std::size_t kept = s.slice_count[0];
  for (std::size_t i = 1; i < slices; ++i) {
    move_candidates(t, used + kept, t, used + i * kTouchSlice * kGroupRows, s.slice_count[i]);
    kept += s.slice_count[i];
  }
  return timed(kept);
}

// How far [voxel] any point within `radius` of the shell's centre moved between two places: never
// less.
double motion_bound(const kernels::Affine& from, const kernels::Affine& to, double radius) {
  double turn = 0, shift = 0;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      const double d = double(to.m[r][c]) - from.m[r][c];
      turn += d * d;
    }
    const double d = double(to.m[r][3]) - from.m[r][3];
    shift += d * d;
  }
  return (std::sqrt(turn) * radius + std::sqrt(shift)) * (1 + 1e-9);
}

// When what is clear by this much may touch. kSlack takes up the rounding of both to float.
float expiry_of(float now, float clearance) { return now + std::max(clearance - kSlack, 0.0f); }

// Where the shell has got to, as length of the way; starts anew when that becomes too long for
// float, or nothing is known.
float travel(Pair& pair, const Search& search) {
  const Shell& shell = search.shell;
  if (pair.travelled >= 0)
    pair.travelled += motion_bound(pair.last_place, search.place, shell.radius * (1 + 1e-6));
  if (!(pair.travelled >= 0 && pair.travelled < kLongestWay)) {
    pair.travelled = 0;
    std::fill_n(pair.group_expiry, shell.groups.count, 0.0f);
    std::fill(pair.group_expiry + shell.groups.count, pair.group_expiry + 16 * shell.blocks.count,
              HUGE_VALF);
    std::fill_n(pair.block_expiry, shell.blocks.count, 0.0f);
    std::fill(pair.block_expiry + shell.blocks.count, pair.block_expiry + shell.blocks.x.count,
              HUGE_VALF);
  }
  pair.last_place = search.place;
  return static_cast<float>(pair.travelled);
}

// Some points of each group of `blocks` blocks, and how deep any of the others may be. Again, with
// fewer, where they are more contacts than there is time for.
std::size_t touch_coarsely(h6Session& s, Pair& pair, TraverseScratch& t, const Search& search,
                           std::size_t blocks, std::size_t used) {
  const auto number = static_cast<std::size_t>(&pair - s.pairs);
  const Samples& samples = search.shell.samples;
  std::size_t found;
  do {
    const int tier = s.anytime.tier;
    const std::size_t each = std::size_t{1} << tier;
    for (std::size_t k = 0; k < blocks; ++k)
      for (std::size_t j = 0; j < each; ++j)
        t.frontier[k * each + j] =
            static_cast<std::uint32_t>(t.open_blocks[k] * Samples::kOfGroup + j);
    const std::int64_t since = s.anytime.by_clock ? sched::now_ns() : 0;
    found = search.touch_samples(t.frontier, blocks * each, candidates_from(t, used), t.clearance);
    learn_sampling(s, blocks * each, pair.open_groups, found, since);
    pair.missed = 0;
    for (std::size_t k = 0; k < blocks; ++k) {
      const float reach = search.scale * samples.reach[tier][t.open_blocks[k]];
      const float least = *std::min_element(t.clearance + k * each, t.clearance + (k + 1) * each);
      // The long form: cells far inside hold no samples.
      pair.missed = std::max(pair.missed, kernels::cull_reach(reach, true) - least);
    }
  } while (must_be_coarser(s, number, used, found, blocks));
  return found;
}

// Candidates of one pair go behind `used`; returns how many there are. Two tiers of spheres, then
// points; of each only what may have come within reach since it was last looked at. Where time is
// short it ends with the deepest tier that is complete: what was not looked at stays expired.
std::size_t traverse_pair(h6Session& s, TraverseScratch& t, Pair& pair, std::size_t used,
                          bool alone) {
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Shell& shell = s.model->shells[a.shell];
  const Field& field = s.model->fields[b.field];
  const float margin = margin_of(s);
  // The short form of culling is proved up to half a voxel of margin.
  const Search search{field.view,
                      shell,
                      shell_to_field(a, shell, b, field),
                      static_cast<float>(1.0 / field.voxel),
                      field.wide || margin > 0.5f,
                      margin,
                      s.rested};
  const float now = travel(pair, search);
  pair.sampled = 0;
  pair.missed = 0;

  std::size_t blocks =
      kernels::expired(pair.block_expiry, nullptr, shell.blocks.x.count / 16, now, t.open_blocks);
  if (blocks == 0) return 0;
  const auto expired_groups = [&] {
    return kernels::expired(pair.group_expiry, t.open_blocks, blocks, now, t.frontier);
  };
  std::size_t count = expired_groups();
  if (count > kFewGroups * blocks && pair.cull_blocks.worth(blocks)) {
    const std::size_t left =
        search.cull(shell.blocks, t.open_blocks, blocks, t.survivors, t.clearance);
    pair.cull_blocks.learn(blocks, left);
    for (std::size_t k = 0; k < blocks; ++k)
      pair.block_expiry[t.open_blocks[k]] = expiry_of(now, t.clearance[k]);
    std::copy_n(t.survivors, left, t.open_blocks);
    blocks = left;
    if (blocks == 0) return 0;
    count = expired_groups();
  }
  const auto number = static_cast<std::size_t>(&pair - s.pairs);
  if (is_coarse_anyway(s, number, used, blocks))
    return touch_coarsely(s, pair, t, search, blocks, used);
  std::size_t groups = count;
  if (pair.cull_groups.worth(count)) {
    groups = search.cull(shell.groups, t.frontier, count, t.survivors, t.clearance);
    for (std::size_t k = 0; k < count; ++k)
      pair.group_expiry[t.frontier[k]] = expiry_of(now, t.clearance[k]);
    pair.cull_groups.learn(count, groups);
  } else {
    std::copy_n(t.frontier, count, t.survivors);
  }
  // Each group waits for memory by itself otherwise.
  for (std::size_t k = 0; k < groups; ++k)
    for (const Column<float>* column : {&shell.x, &shell.y, &shell.z})
      __builtin_prefetch(column->data + kGroupRows * t.survivors[k]);
  if (search.cold)  // what their contacts will be made of
    for (std::size_t k = 0; k < groups; ++k) {
      for (const Column<float>* column : {&shell.nx, &shell.ny, &shell.nz})
        __builtin_prefetch(column->data + kGroupRows * t.survivors[k]);
      __builtin_prefetch(shell.point.data + kGroupRows * t.survivors[k]);
    }
  if (must_be_coarse(s, number, used, blocks, groups)) {
    pair.cull_groups.left_out = 0;
    kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
    return touch_coarsely(s, pair, t, search, blocks, used);
  }
  const std::int64_t since = s.anytime.by_clock ? sched::now_ns() : 0;
  const std::size_t found = touch(s, t, search, groups, used, alone);
  learn_sampling(s, groups, groups, found, since);
  if (must_be_coarser(s, number, used, found, blocks)) {
    kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
    return touch_coarsely(s, pair, t, search, blocks, used);
  }
  pair.sampled = groups;
  for (std::size_t k = 0; k < groups; ++k)
    pair.group_expiry[t.survivors[k]] =
        expiry_of(now, kernels::cull_clearance(t.clearance[k] - margin, search.wide));
  kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
  return found;
}

// Keeps the `most` deepest of `count` candidates, in their order. Ties go to the first.
std::size_t keep_deepest(h6Session& s, std::size_t count, std::size_t most, Pair* pairs,
                         std::size_t pair_count) {
  const TraverseScratch& t = s.traversal[0];
  std::copy_n(t.candidate_distance, count, s.scratch_depth);
  std::nth_element(s.scratch_depth, s.scratch_depth + (most - 1), s.scratch_depth + count);
  const float limit = s.scratch_depth[most - 1];
  std::size_t below = 0;
  for (std::size_t i = 0; i < count; ++i) below += t.candidate_distance[i] < limit;
  std::size_t ties = most - below, n = 0;
  for (std::size_t p = 0; p < pair_count; ++p) {
    const std::size_t first = n;
    for (std::size_t i = pairs[p].first; i < pairs[p].first + pairs[p].candidates; ++i) {
      const float d = t.candidate_distance[i];
      if (d > limit || (d == limit && ties == 0)) continue;
      ties -= d == limit;
      move_candidates(t, n++, t, i, 1);
    }
    pairs[p].candidates = n - first;
    pairs[p].first = first;
  }
  return n;
}

// Points that are only about to touch count where their gap is a sample.
void drop_unsampled(h6Session& s, Pair& pair, const Shell& shell, const Field& field,
                    const kernels::Affine& to_field) {
  const TraverseScratch& t = s.traversal[0];
  std::size_t n = pair.first;
  for (std::size_t i = pair.first; i < pair.first + pair.candidates; ++i) {
    const std::uint32_t row = t.candidate[i];
    if (!(t.candidate_distance[i] < 0) &&
        !is_sampled(field.view, to_field, shell.x[row], shell.y[row], shell.z[row]))
      continue;
    move_candidates(t, n++, t, i, 1);
  }
  pair.candidates = n - pair.first;
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
  const float margin = margin_of(s);
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    const Shell& shell = s.model->shells[a.shell];
    const Field& field = s.model->fields[b.field];
    if (margin > 0) drop_unsampled(s, pair, shell, field, shell_to_field(a, shell, b, field));
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
