// SPDX-License-Identifier: Apache-2.0
// leaves.h - which triangles share a leaf of the tree (see tree.h). Private to
// bake_*.cpp.
#pragma once
#include "io/bake/grid.h"

namespace h6::io::bake {

// All triangles in an order whose eights, 64s and 512s have small boxes around them.
Large<std::uint32_t> order_for_leaves(const Surface& surface, unsigned threads);

}  // namespace h6::io::bake
