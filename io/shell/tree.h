// SPDX-License-Identifier: Apache-2.0
// tree.h - levels and sphere tree of points that are already checked. Private to this folder.
#pragma once
#include <span>

#include "hapsix/result.h"
#include "io/shell/blue_noise.h"
#include "io/shell/shell_data.h"

namespace h6::io {

struct TreeOptions {
  int levels = 7;
  double spacing = 0;  // of the points [m]; 0: not known
  std::uint64_t seed = 1;
  unsigned threads = 0;
  Pulse* pulse = nullptr;  // may be null
};

// At least one point. Fails only by "cancelled".
Result<ShellData> build_tree(std::span<const OrientedPoint> points,
                             std::span<const std::uint32_t> source, const TreeOptions& options);

Outcome check_levels(int levels);  // 1 .. 16

}  // namespace h6::io
