// SPDX-License-Identifier: Apache-2.0
// traverse_pair.cpp - finds the points of a shell that are inside a field.
//
// Xu & Barbic 2016, Sec. 3 after McNeely 1999: a sphere whose signed distance exceeds its radius is
// dropped with all its points. Here the spheres form flat tiers, and a dropped sphere is not tested
// again until its part of the shell may have moved as far as it was clear. The same holds for
// single points. METHOD.md, Sec. 6.
#include "runtime/contact/traverse_pair.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "kernels/contact/cull_spheres.h"
#include "kernels/contact/expiry.h"
#include "kernels/contact/keep_loadable.h"
#include "runtime/contact/deformation.h"
#include "sched/clock.h"

namespace h6 {

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at) {
  return {t.candidate + at, t.candidate_distance + at, t.gradient_x + at, t.gradient_y + at,
          t.gradient_z + at};
}

namespace {

void move_rows(const kernels::Touching& a, const kernels::Touching& b, std::size_t count) {
  if (a.row == b.row || count == 0) return;
  std::memmove(a.row, b.row, count * sizeof *a.row);
  std::memmove(a.distance, b.distance, count * sizeof *a.distance);
  std::memmove(a.gx, b.gx, count * sizeof *a.gx);
  std::memmove(a.gy, b.gy, count * sizeof *a.gy);
  std::memmove(a.gz, b.gz, count * sizeof *a.gz);
}

kernels::Touching rows_from(const kernels::Touching& rows, std::size_t at) {
  return {rows.row + at, rows.distance + at, rows.gx + at, rows.gy + at, rows.gz + at};
}

}  // namespace

void move_candidates(const TraverseScratch& to, std::size_t to_row, const TraverseScratch& from,
                     std::size_t from_row, std::size_t count) {
  move_rows(candidates_from(to, to_row), candidates_from(from, from_row), count);
}

namespace {

// The map from shell coordinates [m], relative to the shell's centre, to voxels of the field.
kernels::Affine shell_to_field(const Body& a, const Body& b) {
  const Shell& shell = *a.shell;
  const Field& field = *b.field;
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

constexpr float kSlack = 1e-3f;  // [voxel]
constexpr std::size_t kFewGroups =
    4;  // testing so few groups of a block is cheaper than testing its sphere
constexpr std::size_t kCached = 256;  // groups whose samples the last frame left in the caches
constexpr double kLongestWay = 256;   // float resolves 3e-5 there [voxel]
constexpr double kRounding = 4e-6;    // error of a motion in float, as a share of the longest one
constexpr double kStays = 0.04;  // a shell nearer than this to its anchor counts as staying [voxel]
// When the shell is slow, only single points of a group are sampled: those nearer than kNearest
// plus the distance of kStepsNear steps like the last one.
constexpr float kNearest = 0.05f;  // [voxel]
constexpr double kStepsNear = 16;
constexpr double kSlowStep = 1 / kStepsNear;  // [voxel]
// If all points of a group are farther than this [voxel], testing its sphere tells soon enough when
// one of them comes near.
constexpr float kFarGroup = 1;

struct Screw {
  float m[6];
};

// The constants of one traversal.
struct Search {
  const kernels::FieldView& field;
  const Shell& shell;
  kernels::Affine place;
  float scale;           // voxels per metre
  kernels::Reach reach;  // of the field's samples
  float margin;          // [voxel]
  bool cold;             // the caches hold little of what is sampled
  float near = 0;        // points are sampled up to this distance; 0: all points of a group [voxel]
  Deformation* bend = nullptr;  // where the shell bends: spheres and points as they are now
  bool reaches = false;         // TraverseScratch::reach says how far each group's points may be
  bool keeps = false;           // only points that can carry load are kept
  Screw ahead{};                // of `reaches` and `keeps`: see keep_loadable.h

  const Tier& blocks() const { return bend ? bend->blocks : shell.blocks; }
  const Tier& groups() const { return bend ? bend->groups : shell.groups; }

  std::size_t cull(const Tier& tier, const std::uint32_t* rows, std::size_t count,
                   std::uint32_t* survivors, float* clearance) const {
    return kernels::cull_spheres(
        field, place, {tier.x.data, tier.y.data, tier.z.data, tier.radius.data, tier.count}, scale,
        reach, margin, rows, 0, count, survivors, clearance, cold);
  }
  // Writes to t.frontier the groups of t.open_blocks of which a point may touch, or may carry load.
  std::size_t loadable(const float* expiry, std::size_t blocks, const TraverseScratch& t) const {
    const Tier& tier = shell.groups;
    const Bundles& normals = shell.normals;
    return kernels::loadable_groups(
        {tier.x.data, tier.y.data, tier.z.data, tier.radius.data, tier.count},
        {normals.nx.data, normals.ny.data, normals.nz.data, normals.spread.data}, ahead.m, margin,
        expiry, t.way_now, t.open_blocks, blocks, t.reach, t.frontier);
  }
  // Evaluates the samples in `vectors`. Rows in `out` are rows of the shell.
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
  std::size_t keep_loadable(const kernels::Touching& rows, std::size_t count) const {
    return kernels::keep_loadable({shell.x.data, shell.y.data, shell.z.data, shell.nx.data,
                                   shell.ny.data, shell.nz.data, shell.point.data},
                                  rows, count, ahead.m);
  }
  // Samples `count` groups of t.survivors from `first` on.
  std::size_t touch(const TraverseScratch& t, std::size_t first, std::size_t count,
                    const kernels::Touching& out) const {
    if (bend) bend_points(*bend, t.survivors + first, count);
    const Column<float>&x = bend ? bend->x : shell.x, &y = bend ? bend->y : shell.y,
          &z = bend ? bend->z : shell.z;
    const std::size_t found = kernels::touch_groups(
        field, place, {x.data, y.data, z.data, shell.points}, t.survivors + first, count, margin,
        cold,
        {near > 0 ? t.rows + first : nullptr, t.clearance + first, t.near_rows + first,
         t.rest + first, near, reaches ? t.reach : nullptr, true},
        out);
    return keeps ? keep_loadable(out, found) : found;
  }
};

// How far samples of a field may mislead culling.
kernels::Reach reach_of(const Settings& set, const Field& field) {
  const kernels::Reach reach =
      field.steepest > 0 ? kernels::refined_reach(field.steepest) : kernels::Reach{};
  // The short form of culling is proved for margins of up to half a voxel. Margins change from
  // frame to frame and remembered expiries must stay valid, so the largest margin decides.
  return field.wide || set.contact.margin_voxels > 0.5 ? kernels::wide_reach(reach) : reach;
}

Search search_of(const Settings& set, const Body& a, const Body& b, float margin, bool cold) {
  const Field& field = *b.field;
  return {field.view,
          *a.shell,
          shell_to_field(a, b),
          static_cast<float>(1.0 / field.voxel),
          reach_of(set, field),
          margin,
          cold,
          0,
          a.bend};
}

constexpr std::size_t kMoved = 8;  // slices whose candidates are moved at a time

// Moves the candidates of all slices from t.apart, where each slice has its own rows, behind row
// `used`. Returns their number.
std::size_t join_slices(const TraverseScratch& t, std::size_t used, Lane& lane,
                        std::size_t slices) {
  std::size_t* const found = lane.scratch->slice_count;
  std::size_t end = used;
  for (std::size_t i = 0; i < slices; ++i) end += std::exchange(found[i], end);
  found[slices] = end;
  lane.team->for_slices((slices + kMoved - 1) / kMoved, [&](std::size_t some) {
    for (std::size_t i = some * kMoved; i < std::min((some + 1) * kMoved, slices); ++i)
      move_rows(candidates_from(t, found[i]), rows_from(t.apart, i * kTouchSlice * kGroupRows),
                found[i + 1] - found[i]);
  });
  return end - used;
}

// Samples `count` groups and writes the points that touch behind row `used`. Their order does not
// depend on which thread runs a slice.
std::size_t touch(const Search& search, TraverseScratch& t, Lane& lane, std::size_t count,
                  std::size_t used, bool shared) {
  const auto by_myself = [&] { return search.touch(t, 0, count, candidates_from(t, used)); };
  const std::size_t slices = (count + kTouchSlice - 1) / kTouchSlice;
  if (shared || slices < 2 || t.apart.row == nullptr || lane.team->threads() == 1)
    return by_myself();
  const std::int64_t since = sched::now_ns();
  std::size_t found = 0;
  if (lane.touching.share(count)) {
    lane.team->for_slices(slices, [&](std::size_t i) {
      const std::size_t at = i * kTouchSlice, n = std::min(kTouchSlice, count - at);
      lane.scratch->slice_count[i] = search.touch(t, at, n, rows_from(t.apart, at * kGroupRows));
    });
    found = join_slices(t, used, lane, slices);
  } else {
    found = by_myself();
  }
  lane.touching.took(static_cast<double>(sched::now_ns() - since));
  return found;
}

// The change between two places of a shell in a field.
struct Change {
  kernels::Affine map{};
  double turn = 0, shift = 0;  // bounds on its matrix [voxel/m] and its translation [voxel]

  Change(const kernels::Affine& from, const kernels::Affine& to) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        const double d = double(to.m[r][c]) - from.m[r][c];
        map.m[r][c] = static_cast<float>(d);
        (c < 3 ? turn : shift) += d * d;
      }
    turn = std::sqrt(turn) * (1 + 1e-6), shift = std::sqrt(shift) * (1 + 1e-6);
  }
  // An upper bound on how far a point within `radius` of the shell's centre moved [voxel].
  double most(double radius) const { return turn * radius + shift; }
};

// An upper bound on how far a point moved by bending between two shapes [voxel].
double bending_bound(const Search& search, const float* from) {
  if (!search.bend) return 0;
  double change[H6_MAX_MODES];
  for (int j = 0; j < search.bend->modes; ++j) change[j] = double{search.bend->bent[j]} - from[j];
  return double{search.scale} * bend_way(*search.bend, change);
}

// The way that a sphere's block must have travelled before the sphere may touch, if it has this
// clearance now. kSlack covers the rounding to float. Half of x + |x| is max(x, 0) without a
// branch, which no processor could foretell here.
float expiry_of(float from, float clearance) {
  const float left = clearance - kSlack;
  return from + 0.5f * (left + std::fabs(left));
}

// Updates the ways of the blocks: t.way_now is the distance that a block has travelled through the
// field up to the anchor and from there, t.way_from the distance up to the anchor less that from
// there. They do not grow while the shell moves to and fro around its anchor. They start again from
// zero when they are too long for float, or when nothing is known. Lists in t.open_blocks the
// blocks that may touch, and returns their number.
std::size_t travel(PairSearch& pair, TraverseScratch& t, Search& search) {
  const Shell& shell = search.shell;
  Deformation* const bend = search.bend;
  const double bends = bend ? bend->reach : 0, radius = (shell.radius + bends) * (1 + 1e-6);
  kernels::Motion motion{};
  if (pair.travelled >= 0) {
    const double step = Change(pair.last_place, search.place).most(radius) +
                        (bend ? bending_bound(search, bend->last_bent) : 0);
    if (step < kSlowStep)
      search.near = search.margin + kNearest + static_cast<float>(kStepsNear * step);
    const Change change(pair.anchor, search.place);
    const double bent = bend ? bending_bound(search, bend->anchor_bent) : 0;
    const double most = change.most(radius) + bent;
    motion.settles = !(most < kStays);
    if (motion.settles) pair.travelled += most;
    motion.change = change.map;
    motion.turn = static_cast<float>(change.turn);
    motion.most = static_cast<float>(most);
    // The motion of a block's centre is a sum of products, which may cancel.
    motion.more = static_cast<float>(change.turn * bends + bent + kRounding * most);
  }
  if (!(pair.travelled >= 0 && pair.travelled < kLongestWay)) {
    pair.travelled = 0;
    motion = {};
    motion.settles = true;
    std::fill_n(pair.block_way, shell.blocks.x.count, 0.0f);
    std::fill_n(pair.group_expiry, shell.groups.count, 0.0f);
    std::fill_n(pair.near_rows, shell.groups.count, std::uint16_t{0});
    std::fill(pair.group_expiry + shell.groups.count, pair.group_expiry + 16 * shell.blocks.count,
              HUGE_VALF);
    std::fill_n(pair.block_expiry, shell.blocks.count, 0.0f);
    std::fill(pair.block_expiry + shell.blocks.count, pair.block_expiry + shell.blocks.x.count,
              HUGE_VALF);
  }
  pair.last_place = search.place;
  if (bend) std::copy_n(bend->bent, bend->modes, bend->last_bent);
  if (motion.settles) {
    pair.anchor = search.place;
    if (bend) std::copy_n(bend->bent, bend->modes, bend->anchor_bent);
  }
  const Tier& blocks = shell.blocks;  // at rest; motion.more has what bending adds
  return kernels::travel_blocks(
      {blocks.x.data, blocks.y.data, blocks.z.data, blocks.radius.data, blocks.x.count}, motion,
      pair.block_expiry, search.margin, pair.block_way, t.way_now, t.way_from, t.open_blocks);
}

// Samples some points of each group of `blocks` blocks, and bounds how deep the others may be.
// If that gives more contacts than there is time for, samples again with fewer points.
std::size_t touch_coarsely(const Search& search, PairSearch& pair, TraverseScratch& t,
                           Anytime& anytime, std::size_t blocks, std::size_t used) {
  const Samples& samples = search.shell.samples;
  std::size_t found;
  do {
    const int tier = anytime.tier;
    const std::size_t each = std::size_t{1} << tier;
    for (std::size_t k = 0; k < blocks; ++k)
      for (std::size_t j = 0; j < each; ++j)
        t.frontier[k * each + j] =
            static_cast<std::uint32_t>(t.open_blocks[k] * Samples::kOfGroup + j);
    const std::int64_t since = anytime.by_clock ? sched::now_ns() : 0;
    found = search.touch_samples(t.frontier, blocks * each, candidates_from(t, used), t.clearance);
    learn_sampling(anytime, blocks * each, pair.open_groups, found, since);
    pair.missed = 0;
    for (std::size_t k = 0; k < blocks; ++k) {
      const float reach = search.scale * samples.reach[tier][t.open_blocks[k]];
      const float least = *std::min_element(t.clearance + k * each, t.clearance + (k + 1) * each);
      // The long form is needed, because cells far inside hold no samples.
      pair.missed = std::max(pair.missed,
                             kernels::cull_reach(reach, kernels::wide_reach(search.reach)) - least);
    }
  } while (must_be_coarser(anytime, pair, used, found, blocks));
  return found;
}

// Of the `count` groups in t.frontier, writes those that must be sampled to t.survivors. Groups
// that were near when last sampled are always among them; for the others their spheres decide.
std::size_t find_near_groups(PairSearch& pair, TraverseScratch& t, const Search& search,
                             std::size_t count) {
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
    left = search.cull(search.groups(), t.far, far, t.far_survivors, t.clearance);
    for (std::size_t k = 0; k < far; ++k)
      pair.group_expiry[t.far[k]] =
          expiry_of(t.way_from[t.far[k] / kernels::kBlock], t.clearance[k]);
    pair.cull_groups.learn(far, left);
    others = t.far_survivors;
  }
  std::merge(t.frontier, t.frontier + near, others, others + left, t.survivors);
  return near + left;
}

// Chooses the points of each group that may touch.
void choose_rows(const PairSearch& pair, TraverseScratch& t, const Search& search,
                 std::size_t groups) {
  if (!(search.near > 0)) return;
  for (std::size_t k = 0; k < groups; ++k) {
    const std::uint32_t g = t.survivors[k];
    const float now = t.way_now[g / kernels::kBlock] + search.margin;
    const bool some = pair.near_rows[g] != 0 && pair.rest_expiry[g] > now;
    t.rows[k] = some ? pair.near_rows[g] : kernels::kAllRows;
  }
}

// Counts the bits that are set. std::popcount is a library call on targets without an instruction.
std::size_t bits_of(unsigned rows) {
  rows -= rows >> 1 & 0x5555u;
  rows = (rows & 0x3333u) + (rows >> 2 & 0x3333u);
  rows = (rows + (rows >> 4)) & 0x0f0fu;
  return (rows + (rows >> 8)) & 0x1fu;
}

// Notes when the sampled groups may touch again, and which of their points are near.
void note_groups(PairSearch& pair, const TraverseScratch& t, const Search& search,
                 std::size_t groups) {
  const auto until = [&](std::uint32_t g, float distance) {
    return expiry_of(t.way_from[g / kernels::kBlock],
                     kernels::cull_clearance(distance, search.reach));
  };
  if (!(search.near > 0)) {
    for (std::size_t k = 0; k < groups; ++k) {
      const std::uint32_t g = t.survivors[k];
      pair.group_expiry[g] = until(g, t.clearance[k]);
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
      pair.rest_expiry[g] = until(g, t.rest[k]);
    }
    near += bits_of(pair.near_rows[g]);
    pair.group_expiry[g] = std::min(until(g, t.clearance[k]), pair.rest_expiry[g]);
  }
  pair.pick_rows.learn(kGroupRows * groups, near);
}

// After a pause: the columns that contacts are made from.
void prefetch_normals(const Shell& shell, const TraverseScratch& t, std::size_t groups) {
  for (std::size_t k = 0; k < groups; ++k) {
    for (const Column<float>* column : {&shell.nx, &shell.ny, &shell.nz})
      __builtin_prefetch(column->data + kGroupRows * t.survivors[k]);
    __builtin_prefetch(shell.point.data + kGroupRows * t.survivors[k]);
  }
}

// Bends the normals of the groups that hold these rows.
void bend_candidates(Deformation& d, const TraverseScratch& t, const std::uint32_t* rows,
                     std::size_t count) {
  std::size_t groups = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto g = static_cast<std::uint32_t>(rows[i] / kGroupRows);
    if (groups == 0 || t.frontier[groups - 1] != g) t.frontier[groups++] = g;
  }
  bend_normals(d, t.frontier, groups);
}

// pair.ahead about the shell's centre, in its axes: v in voxels, w in voxels a metre.
Screw ahead_of_shell(const Body& a, const Body& b, const PairSearch& pair) {
  const Eigen::Map<const Eigen::Matrix<float, 6, 1>> ahead(pair.ahead);
  const Mat3 turn = a.R.transpose() / b.field->voxel;
  const Vec3 w = ahead.tail<3>().cast<double>();
  Vec3 arm = a.R * (a.shell->centre - a.com);
  if (a.bend) arm += a.x - a.bend->about;
  const Vec3 v = turn * (ahead.head<3>().cast<double>() + w.cross(arm)), spin = turn * w;
  Screw screw;
  for (int k = 0; k < 3; ++k)
    screw.m[k] = static_cast<float>(v[k]), screw.m[3 + k] = static_cast<float>(spin[k]);
  return screw;
}

// After a traversal that found nothing: for how long the pair can be left out.
void note_quiet(const Settings& set, const Body& a, const Body& b, PairSearch& pair,
                const TraverseScratch& t) {
  float least = HUGE_VALF;
  for (std::size_t k = 0; k < a.shell->blocks.count; ++k)
    least = std::min(least, pair.block_expiry[k] - t.way_now[k]);
  const double margin = uses_series(set.contact) ? set.contact.margin_voxels : 0.0;
  pair.quiet.begin(b.field->voxel * (least - margin - 2 * kSlack), a, b);
}

struct Found {
  std::size_t count = 0;  // candidates
  bool complete = true;   // the traversal was not coarse
  bool loadable = false;  // all of them can carry load
};

Found search_pair(const Settings& set, const Body& a, const Body& b, PairSearch& pair,
                  TraverseScratch& t, Lane& lane, std::size_t used, bool shared) {
  const Shell& shell = *a.shell;
  Anytime& anytime = *lane.anytime;
  Search search = search_of(set, a, b, pair.margin, lane.cold);
  std::size_t blocks = travel(pair, t, search);
  pair.sampled = 0;
  pair.missed = 0;

  if (blocks == 0) return {};
  const auto expired_groups = [&] {
    return kernels::expired(pair.group_expiry, t.open_blocks, blocks, t.way_now, search.margin,
                            t.frontier);
  };
  std::size_t count = expired_groups();
  if (count > kFewGroups * blocks && pair.cull_blocks.worth(blocks)) {
    const std::size_t left =
        search.cull(search.blocks(), t.open_blocks, blocks, t.survivors, t.clearance);
    pair.cull_blocks.learn(blocks, left);
    for (std::size_t k = 0; k < blocks; ++k)
      pair.block_expiry[t.open_blocks[k]] = expiry_of(t.way_from[t.open_blocks[k]], t.clearance[k]);
    std::copy_n(t.survivors, left, t.open_blocks);
    blocks = left;
    if (blocks == 0) return {};
    count = expired_groups();
  }
  const auto note_blocks = [&] {
    kernels::least_of_blocks(pair.group_expiry, t.open_blocks, blocks, pair.block_expiry);
  };
  const auto coarsely = [&] {
    return Found{touch_coarsely(search, pair, t, anytime, blocks, used), false};
  };
  // Samples and bundles of normals do not bend: such a shell is never coarse.
  const bool bends = search.bend != nullptr;
  if (bends) bend_groups(*search.bend, t.open_blocks, blocks);
  if (!bends && is_coarse_anyway(anytime, pair, used, blocks)) return coarsely();
  search.reaches = search.margin > 0 && pair.fit.count == 0 && !bends;
  search.keeps = search.reaches && !(set.contact.fit_offset > 0);
  if (search.reaches) {
    search.ahead = ahead_of_shell(a, b, pair);
    count = search.loadable(pair.group_expiry, blocks, t);
  }
  const std::size_t groups = find_near_groups(pair, t, search, count);
  if (lane.cold) prefetch_normals(shell, t, groups);
  if (!bends && must_be_coarse(anytime, pair, used, blocks, groups)) {
    pair.cull_groups.left_out = 0;
    note_blocks();
    return coarsely();
  }
  if (search.near > 0 && !pair.pick_rows.worth(kGroupRows * groups)) search.near = 0;
  choose_rows(pair, t, search, groups);
  search.cold = lane.cold || groups > kCached;
  const std::int64_t since = anytime.by_clock ? sched::now_ns() : 0;
  const std::size_t found = touch(search, t, lane, groups, used, shared);
  learn_sampling(anytime, groups, groups, found, since);
  if (!bends && must_be_coarser(anytime, pair, used, found, blocks)) {
    note_blocks();
    return coarsely();
  }
  pair.sampled = groups;
  note_groups(pair, t, search, groups);
  note_blocks();
  return {found, true, search.keeps};
}

}  // namespace

double clearance(const Settings& set, const Body& a, const Body& b, double enough, double little,
                 std::uint32_t hint, TraverseScratch& t) {
  const Shell& shell = *a.shell;
  const Search search = search_of(set, a, b, 0, true);
  const float far = static_cast<float>(enough) + kSlack;
  const auto add_groups = [&](std::size_t block, std::size_t groups) {
    const auto vector = static_cast<std::uint32_t>(block);
    if (search.bend) bend_groups(*search.bend, &vector, 1);
    const std::size_t end = std::min(16 * block + 16, shell.groups.count);
    for (std::size_t g = 16 * block; g < end; ++g)
      t.frontier[groups++] = static_cast<std::uint32_t>(g);
    return groups;
  };
  const auto least_of_groups = [&](std::size_t block) {
    const std::size_t groups = add_groups(block, 0);
    search.cull(search.groups(), t.frontier, groups, t.survivors, t.rest);
    return *std::min_element(t.rest, t.rest + groups) - kSlack;
  };
  // A part that touches is soon found: the block that touched last holds a group that is near, or
  // the block that is nearest does. The first saves the test of all blocks.
  if (hint < shell.blocks.count) {
    search.cull(search.blocks(), &hint, 1, t.survivors, t.clearance);
    if (t.clearance[0] < far)
      if (const float found = least_of_groups(hint); found <= little) return found;
  }
  search.cull(search.blocks(), nullptr, shell.blocks.count, t.survivors, t.clearance);
  const float* const nearest = std::min_element(t.clearance, t.clearance + shell.blocks.count);
  if (*nearest < far) {
    const float found = least_of_groups(static_cast<std::size_t>(nearest - t.clearance));
    if (found <= little) return found;
  }
  float least = HUGE_VALF;
  std::size_t groups = 0;
  for (std::size_t block = 0; block < shell.blocks.count; ++block) {
    if (t.clearance[block] < far)
      groups = add_groups(block, groups);
    else
      least = std::min(least, t.clearance[block]);
  }
  search.cull(search.groups(), t.frontier, groups, t.survivors, t.clearance);
  for (std::size_t k = 0; k < groups; ++k) least = std::min(least, t.clearance[k]);
  return least - kSlack;
}

std::size_t traverse_pair(const Settings& set, const Body& a, const Body& b, PairSearch& pair,
                          TraverseScratch& t, Lane& lane, std::size_t used, bool shared) {
  const bool borrows = !pair.group_expiry;
  if (borrows) {
    static_cast<SearchColumns&>(pair) = t.lent;
    pair.travelled = -1;
  }
  const Found all = search_pair(set, a, b, pair, t, lane, used, shared);
  std::size_t found = all.count;
  pair.quiet.way = 0;
  if (found == 0 && pair.fit.count == 0 && !a.bend) note_quiet(set, a, b, pair, t);
  if (borrows) static_cast<SearchColumns&>(pair) = {};
  const kernels::Touching candidates = candidates_from(t, used);
  pair.fit.deepest = 0;
  if (pair.fit.count > 0 || set.contact.fit_offset > 0) {
    const FitRule rule{static_cast<float>(set.contact.fit_offset / b.field->voxel), pair.margin};
    found = relieve(pair.fit, candidates, found, rule, all.complete);
  }
  if (a.bend) bend_candidates(*a.bend, t, candidates.row, found);
  if (found > 0) pair.touched = static_cast<std::uint32_t>(candidates.row[0] / kBlockRows);
  if (!(pair.margin > 0) || all.loadable) return found;
  const PointColumns s = points_of(a);
  return kernels::keep_loadable({s.x, s.y, s.z, s.nx, s.ny, s.nz, a.shell->point.data}, candidates,
                                found, ahead_of_shell(a, b, pair).m);
}

}  // namespace h6
