// SPDX-License-Identifier: Apache-2.0
// shell_data.h - a baked shell in memory; h6ShellDef points into it.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "hapsix/types.h"

namespace h6::io {

inline constexpr std::size_t max_shell_points = 20'000'000;

struct ShellData {
  std::vector<float> x, y, z, nx, ny, nz;   // (points) coarse levels first; normals INWARD
  std::vector<std::uint32_t> source;        // (points) source triangle, or empty
  std::vector<std::uint32_t> level_points;  // (levels) points of the level and all coarser ones
  std::vector<std::uint32_t> level_first;   // (levels + 1) rows in the node arrays
  std::vector<std::uint32_t> node_point, node_first_child, node_child_count;
  std::vector<float> node_radius;
  std::string input_hash;

  std::size_t size() const { return x.size(); }
  h6ShellDef def() const;  // points into this object
};

// Checks all that h6ShellDef promises: sizes, finite places, unit normals, rows of a level that are
// a permutation of its points, children that partition the next level and begin with their parent's
// point, spheres that hold all their descendants. The sentence names the first thing that is wrong.
Outcome check_shell(const ShellData& shell);

// For each point its node on the coarsest level that has it. The shell must pass check_shell.
std::vector<std::uint32_t> first_rows(const ShellData& shell);

// Checks that p is finite and within 1e6 m and n has unit length. The failure completes a sentence
// that begins with the point's name: "has a normal of length 0.3 ...".
Outcome check_point(const float p[3], const float n[3]);

}  // namespace h6::io
