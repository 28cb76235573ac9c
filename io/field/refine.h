// SPDX-License-Identifier: Apache-2.0
// refine.h - one field from two fields of a mesh that share nodes: coarse bricks, and finer samples
// in the cells where the coarse ones would miss a tolerance.
#pragma once
#include <optional>

#include "io/field/field_data.h"

namespace h6::io {

inline constexpr int kCut = 4;  // fine voxels along a coarse one

// Both fields begin at the same node, cover the same box and have the same offset. The signs are
// those of the fine one, which needs no far grid: bit i of inside[brick] is set where coarse node i
// of a fine brick lies inside (2 x 2 x 2, x fastest). The far bounds are the coarse field's.
// Within the fine band, cells keep the coarse samples where these are right to the tolerance [m] at
// the fine nodes; else they get two or four samples a voxel. Beyond, and where the fine field has
// no brick, they keep the coarse samples. The result is continuous.
// None if the finer samples take more than `room` bytes.
std::optional<FieldData> refine(FieldData coarse, FieldData fine,
                                const std::vector<std::uint8_t>& inside, double tolerance,
                                std::uint64_t room, unsigned threads);

// The fine bricks that need samples: those where coarse ones miss a share of the tolerance at nodes
// of a field with half their voxels, within its band. Bit (4z + y) * 4 + x of each coarse brick.
std::vector<std::uint64_t> suspect_bricks(const FieldData& coarse, const FieldData& middle,
                                          double tolerance, unsigned threads);

}  // namespace h6::io
