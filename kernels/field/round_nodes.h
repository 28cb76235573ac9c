// SPDX-License-Identifier: Apache-2.0
// round_nodes.h - distances as the whole numbers of FieldView's nodes.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

// The nearest whole number of quanta [voxel], ties to even, within +-32767. A double of the size of
// kWhole has no fraction; std::nearbyint would be a call.
inline std::int16_t round_node(double voxels, double quantum) {
  constexpr double kWhole = 0x1.8p52, kMost = 32767;
  const double q = std::clamp(voxels / quantum, -kMost, kMost);
  return static_cast<std::int16_t>(static_cast<std::int32_t>((q + kWhole) - kWhole));
}

// out[i] = round_node(metres[i] / voxel, quantum). The distances are finite, voxel > 0 [m], and the
// quantum is a power of two.
void round_nodes(const float* metres, double voxel, double quantum, std::size_t count,
                 std::int16_t* out);
void round_nodes_ref(const float* metres, double voxel, double quantum, std::size_t count,
                     std::int16_t* out);

}  // namespace h6::kernels
