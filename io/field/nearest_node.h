// SPDX-License-Identifier: Apache-2.0
// nearest_node.h - how far the nodes of a far grid are from the nodes near a surface.
#pragma once
#include <vector>

#include "io/field/field_data.h"

namespace h6::io {

// (nodes of the far grid) the square of the distance to the nearest sample of at most `near` [m] in
// size, exact [voxel^2]; infinity if there is none. After P. Felzenszwalb, D. Huttenlocher,
// "Distance transforms of sampled functions", 2012, for every eighth node: one axis at a time, the
// least over a line of parabolas is read off their lower envelope.
std::vector<float> squared_to_nearest(const FieldData& field, double near, unsigned threads);

}  // namespace h6::io
