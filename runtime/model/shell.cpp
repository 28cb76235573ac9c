// SPDX-License-Identifier: Apache-2.0
// shell.cpp - checks a shell and its tree, and lays its points out for traversal. METHOD.md,
// Sec. 6.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "runtime/model/model.h"

namespace h6 {
namespace {

bool check_points(const h6ShellDef& def, h6Error* error) {
  const float* columns[] = {def.x, def.y, def.z, def.nx, def.ny, def.nz};
  for (const float* column : columns)
    if (!column) return fail(error, "x y z and nx ny nz must all be given");
  for (std::size_t i = 0; i < def.point_count; ++i) {
    for (const float* column : columns)
      if (!std::isfinite(column[i])) return fail(error, "point %zu is not finite", i);
    const double n = std::hypot(def.nx[i], def.ny[i], def.nz[i]);
    if (std::fabs(n - 1) > 1e-3)
      return fail(error, "the normal of point %zu has length %g, not 1", i, n);
  }
  return true;
}

// Each level's nodes are the children of the level before, each once, and the last level holds
// every point once. So traversal reaches each point exactly once.
bool check_tree(const h6ShellDef& def, h6Error* error) {
  if (def.point_count == 0 || def.point_count > UINT32_MAX / 2)
    return fail(error, "a shell needs 1 to 2147483647 points, this one has %zu", def.point_count);
  if (def.level_count < 1 || def.level_count > 32 || !def.level_first || !def.node_point ||
      !def.node_radius || !def.node_first_child || !def.node_child_count)
    return fail(error, "a shell needs 1 to 32 levels and all node arrays");
  if (def.level_first[0] != 0) return fail(error, "level_first[0] must be 0");
  for (std::uint32_t l = 0; l < def.level_count; ++l)
    if (def.level_first[l + 1] <= def.level_first[l])
      return fail(error, "level %u has no nodes", l);
  const std::uint32_t last = def.level_count - 1;
  if (def.level_first[last + 1] - def.level_first[last] != def.point_count)
    return fail(error, "the last level has %u nodes for %zu points",
                def.level_first[last + 1] - def.level_first[last], def.point_count);
  for (std::uint32_t l = 0; l < def.level_count; ++l) {
    std::uint32_t next = def.level_first[l + 1];
    for (std::uint32_t r = def.level_first[l]; r < def.level_first[l + 1]; ++r) {
      if (def.node_point[r] >= def.point_count)
        return fail(error, "node %u names point %u of %zu", r, def.node_point[r], def.point_count);
      if (!(def.node_radius[r] >= 0) || !std::isfinite(def.node_radius[r]))
        return fail(error, "the radius of node %u is %g", r, def.node_radius[r]);
      if (l == last) {
        if (def.node_child_count[r] != 0)
          return fail(error, "node %u of the last level has children", r);
        continue;
      }
      if (def.node_child_count[r] == 0 || def.node_first_child[r] != next ||
          def.node_child_count[r] > def.level_first[l + 2] - next)
        return fail(error, "the children of node %u do not follow those of the node before it", r);
      next += def.node_child_count[r];
    }
    if (l < last && next != def.level_first[l + 2])
      return fail(error, "level %u has nodes that are nobody's children", l + 1);
  }
  return true;
}

// A sphere that does not enclose its descendants would silently lose contacts.
bool check_spheres(const h6ShellDef& def, const h6Allocator& allocator, h6Error* error) {
  // Parents are found in one sweep; then each node of the last level walks up.
  const std::uint32_t nodes = def.level_first[def.level_count];
  Buffer<std::uint32_t> parent;
  if (!parent.reserve(allocator, nodes))
    return fail(error, H6_ERROR_MEMORY, "no memory to check %u nodes", nodes);
  for (std::uint32_t r = 0; r < def.level_first[def.level_count - 1]; ++r)
    for (std::uint32_t c = 0; c < def.node_child_count[r]; ++c)
      parent[def.node_first_child[r] + c] = r;
  for (std::uint32_t leaf = def.level_first[def.level_count - 1]; leaf < nodes; ++leaf) {
    const std::uint32_t p = def.node_point[leaf];
    for (std::uint32_t r = leaf; r >= def.level_first[1] && def.level_count > 1;) {
      r = parent[r];
      const std::uint32_t q = def.node_point[r];
      const double d = std::hypot(double(def.x[p]) - def.x[q], double(def.y[p]) - def.y[q],
                                  double(def.z[p]) - def.z[q]);
      if (d > def.node_radius[r] * (1 + 1e-5) + 1e-9)
        return fail(error, "the sphere of node %u (radius %g m) does not hold point %u, %g m away",
                    r, def.node_radius[r], p, d);
    }
  }
  return true;
}

// Splits rows [begin, end) at medians of the longest axis into parts of `unit` rows; only the last
// part may be smaller.
void split_at_medians(std::uint32_t* rows, std::size_t begin, std::size_t end, std::size_t unit,
                      const float* const axes[3]) {
  if (end - begin <= unit) return;
  int axis = 0;
  float longest = -1;
  for (int k = 0; k < 3; ++k) {
    float low = axes[k][rows[begin]], high = low;
    for (std::size_t i = begin; i < end; ++i) {
      low = std::min(low, axes[k][rows[i]]);
      high = std::max(high, axes[k][rows[i]]);
    }
    if (high - low > longest) longest = high - low, axis = k;
  }
  const std::size_t units = (end - begin + unit - 1) / unit;
  const std::size_t middle = begin + units / 2 * unit;
  const float* column = axes[axis];
  // Ties go by number, so that the order does not depend on the library.
  std::nth_element(rows + begin, rows + middle, rows + end,
                   [column](std::uint32_t a, std::uint32_t b) {
                     return column[a] != column[b] ? column[a] < column[b] : a < b;
                   });
  split_at_medians(rows, begin, middle, unit, axes);
  split_at_medians(rows, middle, end, unit, axes);
}

// Nearly the smallest sphere of rows [begin, end): ever shorter steps towards the farthest point
// (Badoiu & Clarkson 2003). The radius encloses all rows, wherever the centre ends.
void enclose(const Shell& shell, std::size_t begin, std::size_t end, Tier& tier, std::size_t at) {
  Vec3 c = Vec3::Zero();
  for (std::size_t i = begin; i < end; ++i) c += Vec3(shell.x[i], shell.y[i], shell.z[i]);
  c /= static_cast<double>(end - begin);
  for (int step = 0; step < 64; ++step) {
    std::size_t farthest = begin;
    double most = -1;
    for (std::size_t i = begin; i < end; ++i) {
      const double d = (Vec3(shell.x[i], shell.y[i], shell.z[i]) - c).squaredNorm();
      if (d > most) most = d, farthest = i;
    }
    c += (Vec3(shell.x[farthest], shell.y[farthest], shell.z[farthest]) - c) / (step + 2);
  }
  const Eigen::Vector3f f = c.cast<float>();
  double radius = 0;
  for (std::size_t i = begin; i < end; ++i)
    radius = std::max(radius, (Vec3(shell.x[i], shell.y[i], shell.z[i]) - f.cast<double>()).norm());
  tier.x[at] = f.x(), tier.y[at] = f.y(), tier.z[at] = f.z();
  tier.radius[at] = static_cast<float>(radius * 1.000001);
}

void make_tier(const Shell& shell, std::size_t rows, Tier& tier) {
  for (std::size_t i = 0; i < tier.count; ++i)
    enclose(shell, i * rows, std::min((i + 1) * rows, shell.points), tier, i);
  for (std::size_t i = tier.count; i < tier.x.count; ++i)
    for (Column<float>* column : {&tier.x, &tier.y, &tier.z, &tier.radius})
      (*column)[i] = (*column)[tier.count - 1];
}

constexpr double kCellNormals = 0.02;   // no normal is farther from the cell's first one
constexpr double kCellSize = 1.0 / 16;  // no point is farther from the cell's first one [radius]

// Sorts the rows of each group by cells: the first row that has none yet takes in all that are like
// it.
void make_cells(const h6ShellDef& def, std::size_t n, double radius, std::uint32_t* rows,
                std::uint32_t* cell) {
  const auto like = [&](std::uint32_t a, std::uint32_t b) {
    const double turn =
        std::hypot(def.nx[a] - def.nx[b], def.ny[a] - def.ny[b], def.nz[a] - def.nz[b]);
    const double gap = std::hypot(def.x[a] - def.x[b], def.y[a] - def.y[b], def.z[a] - def.z[b]);
    return turn < kCellNormals && gap < kCellSize * radius;
  };
  std::uint32_t number = 0;
  for (std::size_t first = 0; first < n; first += kGroupRows) {
    const std::size_t end = std::min(n, first + kGroupRows);
    for (std::size_t i = first; i < end; ++number) {
      const std::uint32_t seed = rows[i];
      std::size_t next = i + 1;
      for (std::size_t k = next; k < end; ++k)
        if (like(rows[k], seed)) std::swap(rows[next++], rows[k]);
      for (; i < next; ++i) cell[i] = number;
    }
  }
}

void bundle_normals(const Shell& shell, Bundles& bundles) {
  for (std::size_t g = 0; g < bundles.spread.count; ++g) {
    const std::size_t first = std::min(g, shell.groups.count - 1) * kGroupRows;
    const std::size_t end = std::min(first + kGroupRows, shell.points);
    const auto normal = [&](std::size_t i) { return Vec3(shell.nx[i], shell.ny[i], shell.nz[i]); };
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = first; i < end; ++i) mean += normal(i);
    const Eigen::Vector3f n = (mean / static_cast<double>(end - first)).cast<float>();
    double spread = 0;
    for (std::size_t i = first; i < end; ++i)
      spread = std::max(spread, (normal(i) - n.cast<double>()).norm());
    bundles.nx[g] = n.x(), bundles.ny[g] = n.y(), bundles.nz[g] = n.z();
    bundles.spread[g] = static_cast<float>(spread * 1.000001 + 1e-6);
  }
}

void take_samples(const Shell& shell, Samples& samples) {
  for (Column<float>& reach : samples.reach) std::fill_n(reach.data, shell.blocks.count, 0.0f);
  const auto place = [&](std::size_t r) { return Vec3(shell.x[r], shell.y[r], shell.z[r]); };
  for (std::size_t g = 0; g < shell.blocks.count * kGroupRows; ++g) {
    const std::size_t group = std::min(g, shell.groups.count - 1), first = group * kGroupRows;
    const std::size_t rows = std::min(kGroupRows, shell.points - first), block = g / kGroupRows;
    const Vec3 centre(shell.groups.x[group], shell.groups.y[group], shell.groups.z[group]);
    double gap[kGroupRows];  // distance of each point to the nearest sample
    std::size_t next = first;
    for (std::size_t i = 0; i < rows; ++i) {
      gap[i] = HUGE_VAL;
      if ((place(first + i) - centre).squaredNorm() < (place(next) - centre).squaredNorm())
        next = first + i;
    }
    for (std::size_t j = 0; j < Samples::kOfGroup; ++j) {
      const std::size_t at = (block * Samples::kOfGroup + j) * kGroupRows + g % kGroupRows;
      const bool is_one = g < shell.groups.count && j < rows;
      samples.row[at] = is_one ? static_cast<std::uint32_t>(next) : Samples::kNoRow;
      samples.x[at] = shell.x[next], samples.y[at] = shell.y[next], samples.z[at] = shell.z[next];
      const Vec3 sample = place(next);
      double farthest = -1;
      for (std::size_t i = 0; i < rows; ++i) {
        gap[i] = std::min(gap[i], (place(first + i) - sample).norm());
        if (gap[i] > farthest) farthest = gap[i], next = first + i;
      }
      if (!std::has_single_bit(j + 1)) continue;
      float& reach = samples.reach[std::bit_width(j)][block];
      reach = std::max(reach, static_cast<float>(farthest * 1.000001));
    }
  }
}

// Called twice: with an empty arena to count, then to take. The columns that traversal reads come
// first.
void lay_out(Shell& shell, Arena& arena) {
  const std::size_t padded = (shell.points + kBlockRows - 1) / kBlockRows * kBlockRows;
  for (auto [tier, rows] : {std::pair{&shell.blocks, kBlockRows}, {&shell.groups, kGroupRows}}) {
    tier->count = (shell.points + rows - 1) / rows;
    for (Column<float>* column : {&tier->x, &tier->y, &tier->z, &tier->radius})
      column->take(arena, (tier->count + 15) / 16 * 16);
  }
  Bundles& normals = shell.normals;
  for (Column<float>* column : {&normals.nx, &normals.ny, &normals.nz, &normals.spread})
    column->take(arena, shell.groups.x.count);
  for (Column<float>* column : {&shell.x, &shell.y, &shell.z, &shell.nx, &shell.ny, &shell.nz})
    column->take(arena, padded);
  shell.point.take(arena, padded);
  shell.cell.take(arena, padded);
  Samples& samples = shell.samples;
  for (Column<float>* column : {&samples.x, &samples.y, &samples.z})
    column->take(arena, shell.blocks.count * kGroupRows * Samples::kOfGroup);
  samples.row.take(arena, shell.blocks.count * kGroupRows * Samples::kOfGroup);
  for (Column<float>& reach : samples.reach) reach.take(arena, shell.blocks.count);
}

}  // namespace

bool convert_shell(const h6ShellDef& def, const h6Allocator& allocator, Shell* shell,
                   h6Error* error) {
  if (!check_reserved(def, "", error) || !check_tree(def, error) || !check_points(def, error) ||
      !check_spheres(def, allocator, error))
    return false;
  const std::size_t n = shell->points = def.point_count;
  const std::size_t padded = (n + kBlockRows - 1) / kBlockRows * kBlockRows;
  Arena room;
  lay_out(*shell, room);
  if (!shell->memory.reserve(allocator, room.used()))
    return fail(error, H6_ERROR_MEMORY, "no memory for %zu points", n);
  Arena arena(shell->memory.data, shell->memory.count);
  lay_out(*shell, arena);

  std::uint32_t* rows = shell->point.data;
  for (std::size_t i = 0; i < n; ++i) rows[i] = static_cast<std::uint32_t>(i);
  const float* const axes[3] = {def.x, def.y, def.z};
  split_at_medians(rows, 0, n, kBlockRows, axes);
  for (std::size_t first = 0; first < n; first += kBlockRows)
    split_at_medians(rows, first, std::min(n, first + kBlockRows), kGroupRows, axes);

  Vec3 low = Vec3::Constant(HUGE_VAL), high = -low;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p(def.x[i], def.y[i], def.z[i]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  shell->box = {low, high};
  shell->centre = 0.5 * (low + high);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p(def.x[i], def.y[i], def.z[i]);
    shell->radius = std::max(shell->radius, (p - shell->centre).norm());
  }
  make_cells(def, n, shell->radius, rows, shell->cell.data);
  for (std::size_t i = n; i < padded; ++i)
    rows[i] = rows[n - 1], shell->cell[i] = shell->cell[n - 1];
  for (std::size_t i = 0; i < padded; ++i) {
    const std::uint32_t p = rows[i];
    const Vec3 q = Vec3(def.x[p], def.y[p], def.z[p]) - shell->centre;
    shell->x[i] = static_cast<float>(q.x());
    shell->y[i] = static_cast<float>(q.y());
    shell->z[i] = static_cast<float>(q.z());
    shell->nx[i] = def.nx[p], shell->ny[i] = def.ny[p], shell->nz[i] = def.nz[p];
  }
  make_tier(*shell, kGroupRows, shell->groups);
  make_tier(*shell, kBlockRows, shell->blocks);
  bundle_normals(*shell, shell->normals);
  take_samples(*shell, shell->samples);
  return !def.deformable || convert_deformable(*def.deformable, allocator, shell, error);
}

}  // namespace h6
