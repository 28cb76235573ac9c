// SPDX-License-Identifier: Apache-2.0
// round_nodes_ref.cpp - the specification of round_nodes.
#include "kernels/field/round_nodes.h"

namespace h6::kernels {

void round_nodes_ref(const float* metres, double voxel, double quantum, std::size_t count,
                     std::int16_t* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = round_node(metres[i] / voxel, quantum);
}

}  // namespace h6::kernels
