// SPDX-License-Identifier: Apache-2.0
// leaves.h - which triangles share a leaf of the tree (tree.h). Private to this folder.
#pragma once
#include "io/bake/grid.h"

namespace h6::io::bake {

// All triangles, in an order in which runs of 8, 64 and 512 have small boxes around them.
Large<std::uint32_t> order_for_leaves(const Surface& surface, unsigned threads);

}  // namespace h6::io::bake
