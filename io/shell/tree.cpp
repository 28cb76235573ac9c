// SPDX-License-Identifier: Apache-2.0
// tree.cpp - levels and sphere tree of given points.
//
// Levels are chosen from fine to coarse: each is a blue-noise subset of the one below it, so
// S1 c S2 c ... holds by construction and each has its exact size. The coarse levels only steer the
// traversal, so the Euclidean distance decides there and normals do not count.
//
//   rows:   level 1  [ a . . b . ]            a row is a node: a point and its sphere
//           level 2  [ a x y . . b z . ]      the children of a: a itself, then the new points that
//           level 3  [ a . . x . . y ... ]    are nearest to a; the rows of a level are the
//           children
//                                             of the rows above, in order
#include "io/shell/tree.h"

#include <algorithm>
#include <cmath>

#include "io/file/radix_sort.h"
#include "io/shell/bake_shell.h"
#include "io/shell/nearest_point.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using Ids = std::vector<std::uint32_t>;

constexpr std::uint32_t no_row = UINT32_MAX;

// A level has 3 to 4 times the points of the one above it (4 is the ratio when the radius doubles).
// If there are too few points for the wanted levels, the shell has as many as fit.
struct LevelPlan {
  int levels;
  double ratio;
};

LevelPlan plan_levels(std::size_t points, int wanted) {
  const double n = double(points);
  int levels = wanted;
  while (levels > 1 && std::pow(3.0, levels - 1) > n * (1 + 1e-12)) --levels;
  if (levels == 1) return {1, 4};
  return {levels, std::clamp(std::pow(n, 1.0 / (levels - 1)), 3.0, 4.0)};
}

std::size_t level_size(std::size_t points, const LevelPlan& plan, int level) {
  const double n = double(points) / std::pow(plan.ratio, plan.levels - 1 - level);
  return std::max<std::size_t>(1, std::size_t(std::llround(n)));
}

double diagonal(std::span<const OrientedPoint> points) {
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    float low = INFINITY, high = -INFINITY;
    for (const OrientedPoint& q : points)
      low = std::min(low, q.p[a]), high = std::max(high, q.p[a]);
    sum += (double(high) - double(low)) * (double(high) - double(low));
  }
  return std::sqrt(sum);
}

// Ids of each level, coarse first; empty when the user cancelled.
std::vector<Ids> choose_levels(std::span<const OrientedPoint> points, const TreeOptions& options) {
  const LevelPlan plan = plan_levels(points.size(), options.levels);
  std::vector<Ids> levels(std::size_t(plan.levels));
  Ids& finest = levels.back();
  finest.resize(points.size());
  for (std::uint32_t i = 0; i < finest.size(); ++i) finest[i] = i;
  // Twice the squared diagonal is about the area of a bulky body. A larger guess costs little.
  double radius = diagonal(points) * std::sqrt(2.0 / double(points.size()));
  if (options.spacing > 0) radius = options.spacing;
  std::vector<OrientedPoint> finer(points.begin(), points.end());
  for (int level = plan.levels - 2; level >= 0; --level) {
    const Ids& below = levels[std::size_t(level) + 1];
    radius *= std::sqrt(plan.ratio) * 1.15;
    Thinning thinning;
    thinning.target = level_size(points.size(), plan, level);
    thinning.first_radius = radius;
    thinning.seed = options.seed + std::uint64_t(level) + 1;
    thinning.threads = options.threads;
    thinning.pulse = options.pulse;
    const Thinned thinned = thin_out(finer, thinning);
    if (thinned.cancelled) return {};
    if (thinned.spacing > 0) radius = thinned.spacing;
    Ids& ids = levels[std::size_t(level)];
    std::vector<OrientedPoint> kept;
    ids.reserve(thinned.chosen.size());
    kept.reserve(thinned.chosen.size());
    for (const std::uint32_t row : thinned.chosen) {
      ids.push_back(below[row]);
      kept.push_back(finer[row]);
    }
    finer = std::move(kept);
  }
  return levels;
}

// Puts the first level into Morton order. Finer levels follow their parents, so neighbours in space
// are neighbours in memory.
void sort_along_curve(std::span<const OrientedPoint> points, const TreeOptions& options, Ids& ids) {
  float low[3] = {INFINITY, INFINITY, INFINITY}, extent = 0;
  for (int a = 0; a < 3; ++a) {
    float high = -INFINITY;
    for (const auto id : ids) {
      low[a] = std::min(low[a], points[id].p[a]);
      high = std::max(high, points[id].p[a]);
    }
    extent = std::max(extent, high - low[a]);
  }
  const auto code = [&](std::uint32_t id) {
    std::uint64_t bits = 0;
    for (int a = 0; a < 3; ++a) {
      const double place = extent > 0 ? (points[id].p[a] - low[a]) / double(extent) : 0;
      const auto cell = std::uint64_t(place * 1048575.0);
      for (int b = 0; b < 20; ++b) bits |= ((cell >> b) & 1) << (3 * b + a);
    }
    return bits;
  };
  KeyedIndices coded(ids.size()), spare;
  constexpr std::size_t slice = 4096;
  sched::parallel_for((ids.size() + slice - 1) / slice, options.threads, [&](std::size_t s) {
    for (std::size_t i = s * slice; i < std::min(ids.size(), (s + 1) * slice); ++i) {
      coded[i] = {code(ids[i]), ids[i]};
    }
  });
  radix_sort(coded, spare, options.threads, options.pulse);
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = coded[i].index;
}

// The points of a level that are not in the coarser one, and the parent of each.
struct NewPoints {
  Ids ids, parents;
};

NewPoints hang_new_points(std::span<const OrientedPoint> points, const Ids& coarse, const Ids& fine,
                          const std::vector<std::uint32_t>& row_of, const TreeOptions& options) {
  NewPoints fresh;
  for (const auto id : fine) {
    if (row_of[id] == no_row) fresh.ids.push_back(id);
  }
  fresh.parents.resize(fresh.ids.size());
  const NearestPoint nearest(points, coarse, options.pulse);
  constexpr std::size_t slice = 1024;
  sched::parallel_for((fresh.ids.size() + slice - 1) / slice, options.threads, [&](std::size_t s) {
    if (!alive(options.pulse)) return;
    for (std::size_t i = s * slice; i < std::min(fresh.ids.size(), (s + 1) * slice); ++i) {
      fresh.parents[i] = nearest(points[fresh.ids[i]].p);
    }
  });
  return fresh;
}

// The rows of the next level: each row of this one, followed by its new points.
struct NextRows {
  Ids rows;                                 // ids
  std::vector<std::uint32_t> first, count;  // of the children, counted within the next level
};

NextRows next_rows(const Ids& rows, const NewPoints& fresh,
                   const std::vector<std::uint32_t>& row_of) {
  NextRows next;
  next.count.assign(rows.size(), 1);
  for (const auto parent : fresh.parents) ++next.count[row_of[parent]];
  next.first.resize(rows.size());
  std::uint32_t total = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    next.first[r] = total;
    total += next.count[r];
  }
  next.rows.resize(total);
  std::vector<std::uint32_t> end = next.first;
  for (std::size_t r = 0; r < rows.size(); ++r) next.rows[end[r]++] = rows[r];
  for (std::size_t i = 0; i < fresh.ids.size(); ++i) {
    next.rows[end[row_of[fresh.parents[i]]]++] = fresh.ids[i];
  }
  return next;
}

// Radii are distances in double, rounded up by more than any evaluation in float can be off:
// culling must never lose a descendant (METHOD.md, Sec. 6).
float rounded_up(double distance) {
  if (distance == 0) return 0;
  return std::nextafter(float(distance * (1 + 1e-6)), INFINITY);
}

void add_radii(ShellData& shell, Pulse* pulse) {
  const std::size_t levels = shell.level_points.size(), first_leaf = shell.level_first[levels - 1];
  std::vector<std::uint32_t> parent(shell.node_point.size(), no_row);
  for (std::uint32_t row = 0; row < first_leaf; ++row) {
    for (std::uint32_t c = 0; c < shell.node_child_count[row]; ++c) {
      parent[shell.node_first_child[row] + c] = row;
    }
  }
  std::vector<double> reach2(shell.node_point.size(), 0);
  for (std::size_t leaf = first_leaf; leaf < shell.node_point.size(); ++leaf) {
    if (leaf % 65536 == 0 && !alive(pulse)) return;
    const std::uint32_t p = shell.node_point[leaf];
    for (std::uint32_t row = parent[leaf]; row != no_row; row = parent[row]) {
      const std::uint32_t c = shell.node_point[row];
      const double dx = double(shell.x[p]) - double(shell.x[c]),
                   dy = double(shell.y[p]) - double(shell.y[c]),
                   dz = double(shell.z[p]) - double(shell.z[c]);
      reach2[row] = std::max(reach2[row], dx * dx + dy * dy + dz * dz);
    }
  }
  shell.node_radius.resize(reach2.size());
  for (std::size_t row = 0; row < reach2.size(); ++row) {
    shell.node_radius[row] = rounded_up(std::sqrt(reach2[row]));
  }
}

void add_points(ShellData& shell, std::span<const OrientedPoint> points,
                std::span<const std::uint32_t> source, const Ids& order) {
  const auto column = [&](std::vector<float>& out, auto value) {
    out.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) out[i] = value(points[order[i]]);
  };
  column(shell.x, [](const OrientedPoint& q) { return q.p[0]; });
  column(shell.y, [](const OrientedPoint& q) { return q.p[1]; });
  column(shell.z, [](const OrientedPoint& q) { return q.p[2]; });
  column(shell.nx, [](const OrientedPoint& q) { return q.n[0]; });
  column(shell.ny, [](const OrientedPoint& q) { return q.n[1]; });
  column(shell.nz, [](const OrientedPoint& q) { return q.n[2]; });
  if (source.empty()) return;
  for (const auto id : order) shell.source.push_back(source[id]);
}

}  // namespace

Result<ShellData> build_tree(std::span<const OrientedPoint> points,
                             std::span<const std::uint32_t> source, const TreeOptions& options) {
  std::vector<Ids> levels = choose_levels(points, options);
  const Failure cancelled{"cancelled"};
  if (levels.empty()) return cancelled;
  ShellData shell;
  Ids order;                                                 // new place -> id
  std::vector<std::uint32_t> row_of(points.size(), no_row);  // id -> row in the current level
  std::vector<std::uint32_t> place(points.size());           // id -> new place
  Ids rows = levels[0];
  sort_along_curve(points, options, rows);
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const auto first = std::uint32_t(shell.node_point.size());
    shell.level_first.push_back(first);
    shell.level_points.push_back(std::uint32_t(rows.size()));
    if (!alive(options.pulse)) return cancelled;
    for (const auto id : rows) {  // points that are new on this level have no row yet
      if (row_of[id] != no_row) continue;
      place[id] = std::uint32_t(order.size());
      order.push_back(id);
    }
    for (std::uint32_t r = 0; r < rows.size(); ++r) {
      row_of[rows[r]] = r;
      shell.node_point.push_back(place[rows[r]]);
    }
    if (level + 1 == levels.size()) break;
    const NewPoints fresh =
        hang_new_points(points, levels[level], levels[level + 1], row_of, options);
    if (!alive(options.pulse)) return cancelled;
    NextRows next = next_rows(rows, fresh, row_of);
    const auto next_first = first + std::uint32_t(rows.size());
    for (const auto child : next.first) shell.node_first_child.push_back(next_first + child);
    shell.node_child_count.insert(shell.node_child_count.end(), next.count.begin(),
                                  next.count.end());
    rows = std::move(next.rows);
  }
  shell.level_first.push_back(std::uint32_t(shell.node_point.size()));
  shell.node_first_child.resize(shell.node_point.size(), 0);
  shell.node_child_count.resize(shell.node_point.size(), 0);
  if (!alive(options.pulse)) return cancelled;
  add_points(shell, points, source, order);
  if (!alive(options.pulse)) return cancelled;
  add_radii(shell, options.pulse);
  if (!alive(options.pulse)) return cancelled;
  return shell;
}

Outcome check_levels(int levels) {
  if (levels >= 1 && levels <= 16) return Done{};
  return Failure{"A shell cannot have " + std::to_string(levels) +
                 " levels: ask for 1 to 16 (7 is usual)."};
}

Result<ShellData> build_shell(const PointCloud& cloud, int levels) {
  if (Outcome fine = check_levels(levels); !fine) return fine.failure();
  const std::size_t n = cloud.x.size();
  if (n == 0) return Failure{"A shell needs at least one point: the point cloud is empty."};
  if (n > max_shell_points) {
    return Failure{"The point cloud has " + std::to_string(n) +
                   " points, more than the 20 million a shell can have: thin it out first."};
  }
  for (const auto* column : {&cloud.y, &cloud.z, &cloud.nx, &cloud.ny, &cloud.nz}) {
    if (column->size() != n) {
      return Failure{
          "The columns of the point cloud differ in length: each point needs x, y, z "
          "and its inward normal nx, ny, nz."};
    }
  }
  if (!cloud.source.empty() && cloud.source.size() != n) {
    return Failure{"The point cloud has " + std::to_string(n) + " points but " +
                   std::to_string(cloud.source.size()) + " source triangles."};
  }
  std::vector<OrientedPoint> points(n);
  for (std::size_t i = 0; i < n; ++i) {
    points[i] = {{cloud.x[i], cloud.y[i], cloud.z[i]}, {cloud.nx[i], cloud.ny[i], cloud.nz[i]}};
    if (Outcome fine = check_point(points[i].p, points[i].n); !fine) {
      return Failure{"Point " + std::to_string(i) + " of the cloud " + fine.error()};
    }
  }
  try {
    TreeOptions options;
    options.levels = levels;
    return build_tree(points, cloud.source, options);
  } catch (const std::bad_alloc&) {
    return Failure{"Not enough memory for a shell of " + std::to_string(n) + " points."};
  }
}

}  // namespace h6::io
