// shell.cpp - checks a shell's tree and lays its nodes out for traversal.
#include <algorithm>
#include <cmath>

#include "runtime/model.h"

namespace h6 {
namespace {

bool check_points(const h6ShellDef& def, h6Error* error) {
  if (def.point_count == 0 || def.point_count > UINT32_MAX / 2)
    return fail(error, "a shell needs 1 to 2147483647 points, this one has %zu", def.point_count);
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

// Every level's nodes are the children of the level before, each once, and the last level holds
// every point once: then traversal reaches each point exactly once.
bool check_tree(const h6ShellDef& def, h6Error* error) {
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

// A sphere that does not hold its descendants would lose contacts silently.
bool check_spheres(const h6ShellDef& def, h6Error* error) {
  // Each node of the last level walks up; parents are found by a sweep, level by level.
  const std::uint32_t nodes = def.level_first[def.level_count];
  Buffer<std::uint32_t> parent;
  if (!parent.reserve({}, nodes)) return fail(error, "no memory to check %u nodes", nodes);
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

}  // namespace

bool convert_shell(const h6ShellDef& def, const h6Allocator& allocator, Shell* shell,
                   h6Error* error) {
  if (!check_points(def, error) || !check_tree(def, error) || !check_spheres(def, error))
    return false;
  shell->points = def.point_count;
  shell->levels = def.level_count;
  shell->nodes = def.level_first[def.level_count];
  bool reserved = shell->level_first.reserve(allocator, def.level_count + 1);
  for (Buffer<float>* b : {&shell->x, &shell->y, &shell->z, &shell->node_radius})
    reserved = b->reserve(allocator, shell->nodes) && reserved;
  for (Buffer<float>* b : {&shell->nx, &shell->ny, &shell->nz})
    reserved = b->reserve(allocator, shell->points) && reserved;
  for (Buffer<std::uint32_t>* b : {&shell->node_point, &shell->first_child, &shell->child_count})
    reserved = b->reserve(allocator, shell->nodes) && reserved;
  if (!reserved) return fail(error, "no memory for %zu nodes", shell->nodes);

  Vec3 low = Vec3::Constant(HUGE_VAL), high = -low;
  for (std::size_t i = 0; i < def.point_count; ++i) {
    const Vec3 p(def.x[i], def.y[i], def.z[i]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  shell->centre = 0.5 * (low + high);
  for (std::size_t r = 0; r < shell->nodes; ++r) {
    const std::uint32_t p = def.node_point[r];
    const Vec3 q = Vec3(def.x[p], def.y[p], def.z[p]) - shell->centre;
    shell->x[r] = static_cast<float>(q.x());
    shell->y[r] = static_cast<float>(q.y());
    shell->z[r] = static_cast<float>(q.z());
    shell->radius = std::max(shell->radius, q.norm());
    // Rounded up: moving the points to the centre rounds them by an ulp each.
    shell->node_radius[r] = def.node_radius[r] * 1.00001f;
    shell->node_point[r] = p;
    shell->first_child[r] = def.node_first_child[r];
    shell->child_count[r] = def.node_child_count[r];
  }
  std::copy_n(def.nx, def.point_count, shell->nx.data);
  std::copy_n(def.ny, def.point_count, shell->ny.data);
  std::copy_n(def.nz, def.point_count, shell->nz.data);
  std::copy_n(def.level_first, def.level_count + 1, shell->level_first.data);
  return true;
}

}  // namespace h6
