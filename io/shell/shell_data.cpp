// SPDX-License-Identifier: Apache-2.0
// shell_data.cpp - the checks of shell_data.h.
#include "io/shell/shell_data.h"

#include <cmath>

namespace h6::io {
namespace {

std::string number(std::size_t n) { return std::to_string(n); }

Failure wrong(const std::string& what) { return {"The shell is not whole: " + what + "."}; }

Outcome check_sizes(const ShellData& s) {
  const std::size_t n = s.x.size(), nodes = s.node_point.size();
  if (n == 0) return wrong("it has no points");
  if (n > max_shell_points) return wrong("it has " + number(n) + " points, at most 20 million fit");
  for (const auto* column : {&s.y, &s.z, &s.nx, &s.ny, &s.nz}) {
    if (column->size() != n) return wrong("its point columns differ in length");
  }
  if (!s.source.empty() && s.source.size() != n) {
    return wrong("it has " + number(n) + " points but " + number(s.source.size()) +
                 " source triangles");
  }
  if (s.node_radius.size() != nodes || s.node_first_child.size() != nodes ||
      s.node_child_count.size() != nodes) {
    return wrong("its node columns differ in length");
  }
  return Done{};
}

Outcome check_points(const ShellData& s) {
  for (std::size_t i = 0; i < s.size(); ++i) {
    const float p[3] = {s.x[i], s.y[i], s.z[i]}, n[3] = {s.nx[i], s.ny[i], s.nz[i]};
    if (Outcome fine = check_point(p, n); !fine) {
      return Failure{"Point " + number(i) + " of the shell " + fine.error()};
    }
  }
  return Done{};
}

Outcome check_level_table(const ShellData& s) {
  const std::size_t levels = s.level_points.size();
  if (levels < 1 || levels > 32) return wrong("it has " + number(levels) + " levels, not 1 to 32");
  if (s.level_first.size() != levels + 1 || s.level_first[0] != 0) {
    return wrong("its table of levels does not start at row 0 or misses its end");
  }
  for (std::size_t k = 0; k < levels; ++k) {
    const std::uint32_t rows = s.level_first[k + 1] - s.level_first[k];
    if (s.level_first[k + 1] <= s.level_first[k] || rows != s.level_points[k] ||
        (k > 0 && rows < s.level_points[k - 1])) {
      return wrong("level " + number(k + 1) + " does not hold all points of the coarser ones");
    }
  }
  if (s.level_first[levels] != s.node_point.size() || s.level_points[levels - 1] != s.size()) {
    return wrong("its levels do not end with all " + number(s.size()) + " points");
  }
  return Done{};
}

// Checks that the rows of a level are a permutation of its points.
Outcome check_rows(const ShellData& s) {
  std::vector<std::uint32_t> seen(s.size(), 0);
  for (std::uint32_t k = 0; k < s.level_points.size(); ++k) {
    for (std::size_t row = s.level_first[k]; row < s.level_first[k + 1]; ++row) {
      const std::uint32_t p = s.node_point[row];
      if (p >= s.level_points[k]) {
        return wrong("node " + number(row) + " is at point " + number(p) +
                     ", which is not on its level");
      }
      if (seen[p] == k + 1) return wrong("point " + number(p) + " is twice on one level");
      seen[p] = k + 1;
    }
  }
  return Done{};
}

// Checks that the children of a level's rows, in order, are the next level's rows, in order. So no
// row is lost or shared, and no path runs in a circle.
Outcome check_children(const ShellData& s) {
  const std::size_t levels = s.level_points.size(), leaves = s.level_first[levels - 1];
  std::uint64_t expected = s.level_first[1];
  for (std::size_t row = 0; row < leaves; ++row) {
    const std::uint64_t first = s.node_first_child[row], count = s.node_child_count[row];
    if (count == 0 || first != expected || first + count > s.node_point.size() ||
        s.node_point[first] != s.node_point[row]) {
      return wrong("the children of node " + number(row) +
                   " do not follow those of the node before it, the node itself first");
    }
    expected += count;
    for (std::size_t k = 0; k + 1 < levels; ++k) {  // a level's last row must end the next level
      if (row + 1 == s.level_first[k + 1] && expected != s.level_first[k + 2]) {
        return wrong("the children of level " + number(k + 1) + " are not all of the next level");
      }
    }
  }
  for (std::size_t row = leaves; row < s.node_point.size(); ++row) {
    if (s.node_first_child[row] != 0 || s.node_child_count[row] != 0) {
      return wrong("node " + number(row) + " of the last level has children");
    }
  }
  return Done{};
}

Outcome check_spheres(const ShellData& s) {
  const std::size_t leaves = s.level_first[s.level_points.size() - 1];
  std::vector<std::uint32_t> parent(s.node_point.size(), UINT32_MAX);
  for (std::size_t row = 0; row < s.node_point.size(); ++row) {
    if (!(s.node_radius[row] >= 0) || !std::isfinite(s.node_radius[row]) ||
        (row >= leaves && s.node_radius[row] != 0)) {
      return wrong("the radius of node " + number(row) +
                   " is not a length, or not 0 in the last level");
    }
    for (std::uint32_t c = 0; c < s.node_child_count[row]; ++c) {
      parent[s.node_first_child[row] + c] = std::uint32_t(row);
    }
  }
  for (std::size_t leaf = leaves; leaf < s.node_point.size(); ++leaf) {
    const std::uint32_t p = s.node_point[leaf];
    for (std::uint32_t row = parent[leaf]; row != UINT32_MAX; row = parent[row]) {
      const std::uint32_t c = s.node_point[row];
      const double dx = double(s.x[p]) - double(s.x[c]), dy = double(s.y[p]) - double(s.y[c]),
                   dz = double(s.z[p]) - double(s.z[c]), r = s.node_radius[row];
      if (dx * dx + dy * dy + dz * dz > r * r) {
        return wrong("the sphere of node " + number(row) + " does not hold point " + number(p));
      }
    }
  }
  return Done{};
}

}  // namespace

Outcome check_point(const float p[3], const float n[3]) {
  for (int a = 0; a < 3; ++a) {
    if (!(std::abs(p[a]) <= 1e6f)) {
      return Failure{"lies nowhere: a coordinate is not a number or beyond 1,000,000 m."};
    }
  }
  const double length = std::sqrt(double(n[0]) * n[0] + double(n[1]) * n[1] + double(n[2]) * n[2]);
  if (!(std::abs(length - 1) <= 1e-3)) {
    return Failure{"has a normal of length " + std::to_string(length) +
                   ": normals must be unit vectors that point into the body."};
  }
  return Done{};
}

Outcome check_shell(const ShellData& shell) {
  // The order matters: each check relies on those before it.
  for (const auto check :
       {check_sizes, check_points, check_level_table, check_rows, check_children, check_spheres}) {
    if (Outcome fine = check(shell); !fine) return fine;
  }
  return Done{};
}

std::vector<std::uint32_t> first_rows(const ShellData& shell) {
  std::vector<std::uint32_t> row_of(shell.size(), UINT32_MAX);
  for (std::uint32_t row = 0; row < shell.node_point.size(); ++row) {
    std::uint32_t& first = row_of[shell.node_point[row]];
    if (first == UINT32_MAX) first = row;
  }
  return row_of;
}

h6ShellDef ShellData::def() const {
  h6ShellDef def{};
  def.point_count = size();
  def.x = x.data();
  def.y = y.data();
  def.z = z.data();
  def.nx = nx.data();
  def.ny = ny.data();
  def.nz = nz.data();
  def.source = source.empty() ? nullptr : source.data();
  def.level_count = std::uint32_t(level_points.size());
  def.level_first = level_first.data();
  def.node_point = node_point.data();
  def.node_radius = node_radius.data();
  def.node_first_child = node_first_child.data();
  def.node_child_count = node_child_count.data();
  return def;
}

}  // namespace h6::io
