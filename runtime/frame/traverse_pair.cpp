// SPDX-License-Identifier: Apache-2.0
// traverse_pair.cpp - which points of a shell are inside a field.
//
// Xu & Barbic 2016, Sec. 3 after McNeely 1999: a sphere whose signed distance exceeds its radius is
// dropped with all its points. Here in flat tiers, and a sphere that was dropped stays so until the
// shell has moved as far as it was clear; so does a point that was not near. METHOD.md, Sec. 6.
#include "runtime/frame/traverse_pair.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/contact/cull_spheres.h"
#include "kernels/contact/expiry.h"
#include "runtime/frame/anytime.h"
#include "runtime/frame/stages.h"
#include "sched/clock.h"

namespace h6 {

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at) {
  return {t.candidate + at, t.candidate_distance + at, t.gradient_x + at, t.gradient_y + at,
          t.gradient_z + at};
}

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

namespace {

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

// `series` needs the points that are about to touch. [voxel]
float margin_of(const h6Session& s) {
  return s.contact.method == H6_METHOD_SERIES ? static_cast<float>(s.contact.margin_voxels) : 0.0f;
}

constexpr float kSlack = 1e-3f;        // [voxel]
constexpr std::size_t kFewGroups = 4;  // of a block: looked at sooner than the block's sphere
constexpr double kLongestWay = 256;    // [voxel] float has 3e-5 left there
constexpr double kStays = 0.04;        // [voxel] from its anchor, for a shell that moves to and fro
// Points of a group that are looked at by themselves: nearer than kNearest and what so many steps
// like the last one take.
constexpr float kNearest = 0.05f;  // [voxel]
constexpr double kStepsNear = 16;
constexpr double kSlowStep = 1 / kStepsNear;  // [voxel] farther, and all are looked at
// A group all of whose points are farther is no nearer than its sphere says for long.
constexpr float kFarGroup = 1;  // [voxel]

// What one traversal needs of a pair.
struct Search {
  const kernels::FieldView& field;
  const Shell& shell;
  kernels::Affine place;
  float scale;  // voxels a metre
  bool wide;
  float margin;  // [voxel]
  bool cold;     // after a pause others have had the caches
  // Of points that are looked at by themselves in the frames to come; 0: all are, always. [voxel]
  float near = 0;

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
        count, margin, cold, {nullptr, least, nullptr, nullptr, 0}, out);
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
  // Some of t.survivors.
  std::size_t touch(const TraverseScratch& t, std::size_t first, std::size_t count,
                    const kernels::Touching& out) const {
    return kernels::touch_groups(field, place,
                                 {shell.x.data, shell.y.data, shell.z.data, shell.points},
                                 t.survivors + first, count, margin, cold,
                                 {near > 0 ? t.rows + first : nullptr, t.clearance + first,
                                  t.near_rows + first, t.rest + first, near},
                                 out);
  }
};

// Points of `groups` that touch, in order, whatever runs the slices. Behind `used`. `alone`: this
// is a slice itself.
std::size_t touch(h6Session& s, TraverseScratch& t, const Search& search, std::size_t count,
                  std::size_t used, bool alone) {
  const auto by_myself = [&] { return search.touch(t, 0, count, candidates_from(t, used)); };
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
    s.slice_count[i] = search.touch(t, at, n, candidates_from(t, used + at * kGroupRows));
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

// Where the shell is on its way, which does not grow while it moves to and fro. [voxel]
struct Way {
  float now;   // to the anchor, and on from there
  float from;  // to the anchor, less from there: what is clear here counts from this
};

// When what is clear by this much may touch. kSlack takes up the rounding of both to float.
float expiry_of(const Way& way, float clearance) {
  return way.from + std::max(clearance - kSlack, 0.0f);
}

// The way starts anew when it becomes too long for float, or nothing is known.
Way travel(Pair& pair, Search& search) {
  const Shell& shell = search.shell;
  double away = 0;
  if (pair.travelled >= 0) {
    const double radius = shell.radius * (1 + 1e-6);
    const double step = motion_bound(pair.last_place, search.place, radius);
    if (step < kSlowStep)
      search.near = search.margin + kNearest + static_cast<float>(kStepsNear * step);
    away = motion_bound(pair.anchor, search.place, radius);
    if (!(away < kStays)) {
      pair.travelled += away;
      pair.anchor = search.place;
      away = 0;
    }
  }
  if (!(pair.travelled >= 0 && pair.travelled < kLongestWay)) {
    pair.travelled = away = 0;
    pair.anchor = search.place;
    std::fill_n(pair.group_expiry, shell.groups.count, 0.0f);
    std::fill_n(pair.near_rows, shell.groups.count, std::uint16_t{0});
    std::fill(pair.group_expiry + shell.groups.count, pair.group_expiry + 16 * shell.blocks.count,
              HUGE_VALF);
    std::fill_n(pair.block_expiry, shell.blocks.count, 0.0f);
    std::fill(pair.block_expiry + shell.blocks.count, pair.block_expiry + shell.blocks.x.count,
              HUGE_VALF);
  }
  pair.last_place = search.place;
  return {static_cast<float>(pair.travelled + away), static_cast<float>(pair.travelled - away)};
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

// Groups to sample of `count` in t.frontier, in t.survivors. Those that were near when last looked
// at are so still, or nearly; of the others only what their spheres let through.
std::size_t find_near_groups(Pair& pair, TraverseScratch& t, const Search& search,
                             std::size_t count, const Way& way) {
  std::size_t near = 0, far = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t g = t.frontier[k];
    const bool is_near = pair.near_rows[g] != 0;
    t.frontier[near] = t.far[far] = g;
    near += is_near, far += !is_near;
  }
  std::size_t left = far;
  std::uint32_t* others = t.far;
  if (far > 0 && pair.cull_groups.worth(far)) {
    left = search.cull(search.shell.groups, t.far, far, t.far_survivors, t.clearance);
    for (std::size_t k = 0; k < far; ++k)
      pair.group_expiry[t.far[k]] = expiry_of(way, t.clearance[k]);
    pair.cull_groups.learn(far, left);
    others = t.far_survivors;
  }
  std::merge(t.frontier, t.frontier + near, others, others + left, t.survivors);
  return near + left;
}

// Of each group the points that may touch by now.
void choose_rows(const Pair& pair, TraverseScratch& t, const Search& search, std::size_t groups,
                 float now) {
  if (!(search.near > 0)) return;
  for (std::size_t k = 0; k < groups; ++k) {
    const std::uint32_t g = t.survivors[k];
    const bool some = pair.near_rows[g] != 0 && pair.rest_expiry[g] > now;
    t.rows[k] = some ? pair.near_rows[g] : kernels::kAllRows;
  }
}

// A call to the library, where the processor is not known to have an instruction for it.
std::size_t bits_of(unsigned rows) {
  rows -= rows >> 1 & 0x5555u;
  rows = (rows & 0x3333u) + (rows >> 2 & 0x3333u);
  rows = (rows + (rows >> 4)) & 0x0f0fu;
  return (rows + (rows >> 8)) & 0x1fu;
}

// When groups that were sampled may touch again, and which of their points are near.
void note_groups(Pair& pair, const TraverseScratch& t, const Search& search, std::size_t groups,
                 const Way& way) {
  const auto until = [&](float distance) {
    return expiry_of(way, kernels::cull_clearance(distance - search.margin, search.wide));
  };
  if (!(search.near > 0)) {
    for (std::size_t k = 0; k < groups; ++k) {
      const std::uint32_t g = t.survivors[k];
      pair.group_expiry[g] = until(t.clearance[k]);
      if (!(t.clearance[k] < kFarGroup))
        pair.near_rows[g] = 0;
      else if (pair.near_rows[g] == 0)
        pair.near_rows[g] = kernels::kAllRows, pair.rest_expiry[g] = 0;
    }
    return;
  }
  std::size_t near = 0;
  for (std::size_t k = 0; k < groups; ++k) {
    const std::uint32_t g = t.survivors[k];
    if (t.rows[k] == kernels::kAllRows) {
      pair.near_rows[g] = t.clearance[k] < kFarGroup ? t.near_rows[k] : 0;
      pair.rest_expiry[g] = until(t.rest[k]);
    }
    near += bits_of(pair.near_rows[g]);
    pair.group_expiry[g] = std::min(until(t.clearance[k]), pair.rest_expiry[g]);
  }
  pair.look_at_rows.learn(kGroupRows * groups, near);
}

}  // namespace

std::size_t traverse_pair(h6Session& s, TraverseScratch& t, Pair& pair, std::size_t used,
                          bool alone) {
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Shell& shell = s.model->shells[a.shell];
  const Field& field = s.model->fields[b.field];
  const float margin = margin_of(s);
  // The short form of culling is proved up to half a voxel of margin.
  Search search{field.view,
                shell,
                shell_to_field(a, shell, b, field),
                static_cast<float>(1.0 / field.voxel),
                field.wide || margin > 0.5f,
                margin,
                s.rested};
  const Way way = travel(pair, search);
  pair.sampled = 0;
  pair.missed = 0;

  std::size_t blocks = kernels::expired(pair.block_expiry, nullptr, shell.blocks.x.count / 16,
                                        way.now, t.open_blocks);
  if (blocks == 0) return 0;
  const auto expired_groups = [&] {
    return kernels::expired(pair.group_expiry, t.open_blocks, blocks, way.now, t.frontier);
  };
  std::size_t count = expired_groups();
  if (count > kFewGroups * blocks && pair.cull_blocks.worth(blocks)) {
    const std::size_t left =
        search.cull(shell.blocks, t.open_blocks, blocks, t.survivors, t.clearance);
    pair.cull_blocks.learn(blocks, left);
    for (std::size_t k = 0; k < blocks; ++k)
      pair.block_expiry[t.open_blocks[k]] = expiry_of(way, t.clearance[k]);
    std::copy_n(t.survivors, left, t.open_blocks);
    blocks = left;
    if (blocks == 0) return 0;
    count = expired_groups();
  }
  const auto number = static_cast<std::size_t>(&pair - s.pairs);
  if (is_coarse_anyway(s, number, used, blocks))
    return touch_coarsely(s, pair, t, search, blocks, used);
  const std::size_t groups = find_near_groups(pair, t, search, count, way);
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
  if (search.near > 0 && !pair.look_at_rows.worth(kGroupRows * groups)) search.near = 0;
  choose_rows(pair, t, search, groups, way.now);
  const std::int64_t since = s.anytime.by_clock ? sched::now_ns() : 0;
  const std::size_t found = touch(s, t, search, groups, used, alone);
  learn_sampling(s, groups, groups, found, since);
  if (must_be_coarser(s, number, used, found, blocks)) {
    kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
    return touch_coarsely(s, pair, t, search, blocks, used);
  }
  pair.sampled = groups;
  note_groups(pair, t, search, groups, way);
  kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
  return found;
}

}  // namespace h6
